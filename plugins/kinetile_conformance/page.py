"""The page of a judgement: one HTML file without scripts, for light and dark screens and for paper."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from kinetile.instruments import escape, facts, grid, paragraph
from kinetile_conformance.judging import BEGINNING, RUN, SCENES, Judged, Judgement

STYLE = Path(__file__).with_name("page.css").read_text(encoding="utf-8")

MARKS = {"✓": "good", "✗": "bad", "━": "bar"}
"""Classes of cells by their first mark: no meaning is shown by a colour alone."""


def page(of: Judgement, command: str) -> str:
    """Returns the page; ``command`` makes it again."""
    title = "Judged by kinetile: " + ", ".join(each.report.label for each in of.judged)
    made = {"again": command, "kit": of.kit, "drawn": f"{of.examples:,} scenes a check, seed {of.seed}"}
    made |= of.made["versions"] | {name: str(text) for name, text in of.made.items() if name != "versions"}
    sections = {
        "Verdict": _checks(of.judged),
        "Faults and refusals": _seen(of.judged),
        "On named scenes": _measurements(of),
        "What the kit is known to find": _faults(of),
        "Made with": iter([facts("", made.items())]),
    }
    parts = [f"<h1>{escape(title)}</h1>"]
    if of.status != "complete":
        parts.append(paragraph("✗ This page is partial: the judgement was interrupted before its end."))
    parts += [f"<h2>{name}</h2>\n{text}" for name, found in sections.items() if (text := "\n".join(found))]
    body = "\n".join(parts)
    for mark, kind in MARKS.items():
        body = body.replace(f'">{mark}', f'" class="{kind}">{mark}')
    head = '<meta charset="utf-8"><meta name="viewport" content="width=device-width,initial-scale=1">'
    head += f"<title>{escape(title)}</title><style>\n{STYLE}</style>"
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head><body>\n{body}\n</body></html>\n'


def _marked(status: str, text: str) -> str:
    good, open_ = ("passed", "conforms"), ("skipped", "not judged")
    return f"{'✓' if status.startswith(good) else '–' if status in open_ else '✗'} {text}"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:,.0f}" if value >= 100.0 else f"{value:.3g}"


def _checks(judged: Sequence[Judged]) -> Iterator[str]:
    found = [{result.check: result.status for result in each.report.results} for each in judged]
    rows = [["verdict", *(_marked(each.verdict, each.verdict) for each in judged), "of all checks together"]]
    sentences = {result.check: result.sentence for each in judged for result in each.report.results}
    for check, sentence in sentences.items():
        if all(each.get(check, "skipped") == "skipped" for each in found):
            continue  # the next table has the reason
        texts = (_marked(each[check], each[check]) if check in each else "" for each in found)
        rows.append([check, *texts, sentence])
    heads = ("", *(each.report.label for each in judged), "what must hold")
    yield grid("", heads, rows, [False] * len(heads))


def _seen(judged: Sequence[Judged]) -> Iterator[str]:
    for each in judged:
        failed = each.report.failed
        results = [*failed, *(of for of in each.report.results if of.status != "passed" and of not in failed)]
        seen = [("\n".join(each.report.details(of)), _marked(of.status, of.check)) for of in results]
        seen += [(row.differs or row.ended_by or "", row.of) for row in each.rows] + [(each.error, "✗ all")]
        places: dict[str, list[str]] = {}
        for sentence, where in seen:
            places.setdefault(sentence, []).append(where)
        rows = [["\n".join(where), sentence] for sentence, where in places.items() if sentence]
        yield from [grid(each.report.label, ("on", "seen"), rows, (False, False))] if rows else []


def _measurements(of: Judgement) -> Iterator[str]:
    heads = ("", "", "", "contacts / CPU s", "events / contact", "checks", "solves", "KiB")
    rows = []
    for name, path in SCENES.items():
        what = path.read_text(encoding="utf-8").partition("\n")[0].strip("# ")
        mine = [row for each in of.judged for row in each.rows if row.of == name]
        most = max((row.rate for row in mine), default=0.0)
        for at, row in enumerate(mine):
            size = row.process_bytes or row.structure_bytes
            counts = row.structural_per_contact, row.asked_per_contact, row.computed_per_contact
            numbers = (row.contacts_per_cpu_second, *counts, size and size / 1024)
            wrong = "✗ other contacts" if row.differs else "ended early" if row.contacts else "no contacts"
            text = wrong if row.differs or row.ended_by else "━" * round(10.0 * row.rate / (most or 1.0))
            rows.append(["" if at else f"{name}: {what}", row.phase, text, *map(_number, numbers)])
    if rows:
        yield grid("", heads, rows, [False] * 3 + [True] * 5)
        yield paragraph(
            f"Medians of {of.repeats} runs of some {RUN:g} CPU s, in turns, without compiling. A contact: "
            "structural events, candidate checks, exact solves. KiB: of a phase its state and pair set at "
            "the end, of a program the most that its process has had. A program is given the first "
            f"{BEGINNING} contacts; reading and writing lines is part of its time."
        )


def _faults(of: Judgement) -> Iterator[str]:
    found, every = map(sum, zip(*of.faults.values(), strict=True))
    yield paragraph(f"Of {every} faults that were written to test the kit, it finds {found} by default.")
    rows = [[family, *map(str, counts)] for family, counts in of.faults.items()]
    yield grid("", ("faults", "found", "of"), rows, (False, True, True))
