"""Statistics of a study, from tuples of trials and answers. Each result says in plain words what it means.

The methods are those of statsmodels and SciPy; docs/statistics.md says which, and what each assumes.
"""
