"""The published Table 1, shown beside a study with the same ten questions: six participants' ratings, 1 to 5."""

from types import MappingProxyType

PAPER_RATINGS = MappingProxyType(
    {
        "q1": (2, 5, 5, 1, 1, 1),
        "q2": (3, 5, 5, 1, 1, 1),
        "q3": (3, 3, 5, 1, 5, 5),
        "q4": (3, 5, 3, 3, 5, 3),
        "q5": (3, 5, 2, 2, 5, 3),
        "q6": (4, 3, 5, 3, 5, 5),
        "q7": (4, 4, 4, 4, 5, 4),
        "q8": (4, 5, 4, 4, 5, 4),
        "q9": (4, 4, 5, 3, 5, 5),
        "q10": (2, 5, 3, 1, 4, 1),
    }
)
"""By question; each row S1 to S6."""

PAPER_REMARK = (
    "The paper prints 3.6 as the mean of Q3 and of Q4; its own ratings give 3.67 for both (22 / 6), which is shown "
    "here. Standard deviations are the sample's (n − 1)."
)
