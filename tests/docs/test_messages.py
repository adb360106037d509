"""The page of messages has every status, activity and sentence that the core can say."""

import re
from pathlib import Path

import pytest

import sidestep as ss

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "reference" / "messages.md").read_text(encoding="utf-8")
SOURCES = (
    "controller/explain.cpp",
    "controller/explain_goal.cpp",
    "controller/explain_input.cpp",
    "controller/measured_state.cpp",
    "controller/plausibility.cpp",
    "controller/sources.cpp",
    "controller/speed_limiter.cpp",
    "controller/touch_judge.cpp",
    "controller/trajectory_follower.cpp",
    "controller/words.cpp",
    "attractor/diagnosis.cpp",
)
LEAST_WORDS = 3  # of a phrase; less only joins parts of a sentence


def phrases() -> list[str]:
    """String literals of what explains a motion with some words in them."""
    found = []
    for name in SOURCES:
        text = (ROOT / "cpp" / "src" / name).read_text(encoding="utf-8")
        text = re.sub(r"//.*", "", text)
        for literal in re.findall(r'"((?:[^"\\\n]|\\.)*)"', text):
            literal = literal.replace("%%", "%")  # of printf
            words = re.sub(r"%[.0-9]*[a-z]|\\n", "...", literal).strip(" ,;:'()")
            if len(words.replace("...", "").split()) >= LEAST_WORDS and not words.endswith((".hpp", ".h")):
                found.append(words)
    return found


@pytest.mark.parametrize(("kind", "number"), [(ss.SafetyStatus, 8), (ss.Activity, 6)])
def test_every_status_and_activity_is_there(kind: type, number: int) -> None:
    names = [item.name for item in kind]
    assert len(names) == number
    assert [name for name in names if f"| `{name}` |" not in PAGE] == []


def test_every_sentence_is_there() -> None:
    says = phrases()
    assert "no path was found yet; searching again" in says
    assert len(says) > 20
    page = PAGE.replace("...", "").replace("*", "")
    squeezed = re.sub(r"\s+", " ", page)
    missing = [
        words for words in says if re.sub(r"\s+", " ", words.replace("...", "")).strip() not in squeezed
    ]
    assert missing == []
