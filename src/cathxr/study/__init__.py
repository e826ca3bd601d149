"""Studies: design, allocation, surveys, statistics and the report. Pure functions of the trials and answers."""
