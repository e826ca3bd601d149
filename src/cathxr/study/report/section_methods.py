"""The section on methods: what was computed how, so that a reader can judge it and do it again."""

from collections.abc import Sequence

from cathxr.study.analysis.analyse import Analysis
from cathxr.study.analysis.estimates import percent
from cathxr.study.report.document import Block, Bullets, Heading, Paragraph

REFERENCES = (
    "Hills M, Armitage P. The two-period cross-over clinical trial. Br J Clin Pharmacol 1979;8:7–20.",
    "Hoenig JM, Heisey DM. The abuse of power. Am Stat 2001;55:19–24.",
    "Holm S. A simple sequentially rejective multiple test procedure. Scand J Stat 1979;6:65–70.",
    "Koch GG. The use of non-parametric methods in the two-period change-over design. Biometrics 1972;28:577–584.",
    "Liang KY, Zeger SL. Longitudinal data analysis using generalized linear models. Biometrika 1986;73:13–22.",
    "Mancl LA, DeRouen TA. A covariance estimator for GEE with improved small-sample properties. Biometrics "
    "2001;57:126–134.",
    "Schluchter MD, Elashoff JT. Small-sample adjustments to tests with unbalanced repeated measures. "
    "J Stat Comput Simul 1990;37:69–87.",
    "Wilcoxon F. Individual comparisons by ranking methods. Biometrics Bull 1945;1:80–83.",
)


def methods(analysis: Analysis, libraries: Sequence[tuple[str, str]]) -> list[Block]:
    """Return the methods, the libraries with their versions, and the sources."""
    data = analysis.data
    told = [
        "Mixed model: REML with an intercept for each participant (statsmodels MixedLM, Powell's method). Intervals "
        "and p by Student's t with between-within degrees of freedom instead of the normal distribution, which is too "
        "narrow for few participants. Measures that are compared as ratios enter as logarithms.",
        "The mixed model takes a view to help everybody alike. The AB/BA analysis by person does not; where both "
        "disagree, trust the latter.",
        "Counts, such as breaches or targets reached: Poisson regression by generalised estimating equations "
        "(statsmodels GEE) with participants as clusters, working independence, Mancl and DeRouen's covariance, and "
        "Student's t with participants minus columns degrees of freedom. Only the mean is taken for granted: counts "
        "may spread more or less than Poisson's. Counts of trials that the limit cut are of what was done until then.",
        "View × period: the mixed model with this term in the sequence's place, for the primary outcome of studies of "
        "two views.",
        "Exact tests (SciPy) go over all patterns of signs: with ties up to 16 participants, without always; where "
        "they are approximations, the text says so. Zeros are dropped. The signed-rank and permutation tests do not "
        "take the period out; the rank-sum test of period differences does.",
        "Targets not reached: trials cut by the limit stay in the analysis. Cox's model is stratified by participant "
        "(statsmodels PHReg, Efron's ties); it does not take account of chance between people's views.",
        f"Intervals are {percent(1.0 - data.alpha)} ones, tests two-sided. The primary outcome is tested by itself; "
        "Holm's correction goes over the secondary outcomes. No test decides by itself: a p above the limit is no "
        "proof of no difference.",
        "Trials that were practice, marked invalid, aborted or interrupted are not analysed and are listed. Missing "
        "values are not filled in.",
    ]
    if libraries:
        told.append("Computed with " + ", ".join(f"{name} {version}" for name, version in libraries) + ".")
    return [
        Heading("Methods"),
        Bullets(tuple(told)),
        Heading("Sources", 2),
        *(Paragraph(each, "small") for each in REFERENCES),
    ]
