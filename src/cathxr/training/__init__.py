"""Training: tasks, trials as pure functions of Tracks to Events, metrics, score cards."""

from cathxr.training.builtin_tasks import builtin_tasks, find_task
from cathxr.training.card import ScoreCard, score_card
from cathxr.training.carried import Carried, moved_offer, shift_ns
from cathxr.training.orders import order_of
from cathxr.training.placing import PlacedTarget, PlacedTask, place_task
from cathxr.training.practice import Familiarisation, familiarisation, practice_of
from cathxr.training.replay import Replayed, replay_trials, run_task
from cathxr.training.state import Offer, Phase, TrialResult, TrialState
from cathxr.training.task import Place, Plane, Practice, Reach, Target, Task
from cathxr.training.task_file import read_task, task_from_text, task_sha256, task_toml
from cathxr.training.trial import Trial

__all__ = [
    "Carried",
    "Familiarisation",
    "Offer",
    "Phase",
    "Place",
    "PlacedTarget",
    "PlacedTask",
    "Plane",
    "Practice",
    "Reach",
    "Replayed",
    "ScoreCard",
    "Target",
    "Task",
    "Trial",
    "TrialResult",
    "TrialState",
    "builtin_tasks",
    "familiarisation",
    "find_task",
    "moved_offer",
    "order_of",
    "place_task",
    "practice_of",
    "read_task",
    "replay_trials",
    "run_task",
    "score_card",
    "shift_ns",
    "task_from_text",
    "task_sha256",
    "task_toml",
]
