"""The words about the state, as HTML."""

from __future__ import annotations

import html

WORDS_HEIGHT = 236  # [px] at least, what the longest words usually take: what is below them stays where it is
STYLE = (
    "<style>.mantine-Slider-markLabel{translate:0 3px}"  # else a slider's knob covers its least value
    "[role=tab]{padding-inline:5px !important}</style>"  # six tabs in one row
)


def in_box(words: str, facts: str = "", events: tuple[tuple[float, str], ...] = ()) -> str:
    """Words about the state above smaller facts and the last events, the newest first; names that are long are broken,
    and nothing is cut off."""
    lines = "".join(
        f'<div style="opacity:{max(1.0 - 0.14 * age, 0.3):.2f}">{time:.1f} s &nbsp;{html.escape(event)}</div>'
        for age, (time, event) in enumerate(reversed(events))
    )
    return (
        f'<div style="box-sizing:content-box;min-height:{WORDS_HEIGHT}px;overflow-wrap:anywhere;padding:2px 10px;'
        f'line-height:1.35">'
        f'<div style="font-size:14px;font-weight:600">{words}</div>'
        f'<div style="font-size:12px;opacity:0.8;margin-top:4px">{facts}</div>'
        f'<div id="events" style="font-size:12px;margin-top:{6 if lines else 0}px">{lines}</div></div>'
    )


def begun(words: str) -> str:
    """A sentence with its first letter large, unless it begins with the name of a link."""
    first = words.split(" ", 1)[0].rstrip(":,")
    return words[:1].upper() + words[1:] if first.isalpha() else words


def stamped(text: str, stamp: int) -> str:
    """The words with a number by which it is known that a browser has them."""
    return f'{STYLE}<div id="words" data-stamp="{stamp}">{text}</div>'
