"""Malformed files, streams and words of many kinds: a sentence, or a result; no traceback, no hang, 2 GB.

``KINETILE_MALFORMED`` is the number of cases, 100 by default.
"""

import hashlib
import io
import json
import os
import random
import resource
import signal
import sqlite3
import struct
import warnings
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from queue import SimpleQueue
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import kinetile as kt
from command_line import kinetile
from kinetile.errors import KinetileError, SceneError
from kinetile.records import Trajectory
from kinetile.records.log import SIGNATURE
from kinetile.run.saving import files
from kinetile_bench import Study
from kinetile_bench.study.plan import read_plan_file
from kinetile_bench.study.task import digest
from kinetile_conformance import pipe
from kinetile_conformance.cases import load_case
from kinetile_conformance.questions import Contacts
from studies import run_here

pytest.importorskip("pyarrow")

SCENE = """
arena = [8.0, 8.0]
unit = 1.0
start = 0.0
until = 1.0
broad-phase = "cells"
kinds = ["one", "two"]
[options.cells]
spacing = 1.5
[[shapes]]
kind = "disc"
radius = 0.5
[[bodies]]
position = [1.0, 1.0]
velocity = [1.0, 0.25]
shape = 0
kind = "one"
[[bodies]]
position = [3.0, 1.0]
mass = 2.0
shape = 0
kind = "two"
[[commands]]
time = 0.25
at = [0, 7, 0]
turn = 1
velocity = [0.0, 1.0]
[[responses]]
between = ["one", "two"]
response = "restitution"
options = { coefficient = 0.5 }
"""
RECIPE = 'recipe = "grid"\nuntil = 1.0\n[parameters]\nbodies = 4\ndensity = 0.3\nseed = 1\n'
STUDY = """
phases = ["cells"]
seeds = 2
repeats = 1
[[scenes]]
recipe = "grid"
until = 0.1
[scenes.parameters]
bodies = [4, 9]
"""
NUMBERS = [
    *("9223372036854775808", "1" + "0" * 400, "9" * 5000, "-9223372036854775809", "0x" + "f" * 2100),
    *("2147483648", "nan", "inf", "-inf", "1e400", "1e-320", "1e308", "-1", "0", "-0.0"),
]
WORDS = [
    *NUMBERS,
    *("true", "[]", "{}", '""', "[[]]", '"\\u001b[31m"', '"\\u202eabc"', "'\x1b'"),
    *("1979-05-27", '"wall"', "'*'", "[1.0, 2.0, 3.0]", "[9223372036854775808, 1]"),
    *("[" * 100_000, "[" * 40 + "]" * 40, "{ a = " * 40 + "1" + " }" * 40, "a." * 40 + "b = 1"),
]
JSON = [
    *(2**63, -(2**63) - 1, 10**400, -1, 0, 1.5, 1e308, float("nan"), float("inf"), True, None, "", "\x1b"),
    *([], {}, [[]], {"array": "x"}, {"tuple": []}, {"Shape": [1]}, {"Bounds": []}, [1] * 50),
    {"table": [[1]]},
]
ROWS = {
    "phases": ["cells"],
    "seeds": 3,
    "until": 0.1,
    "scenes": [{"recipe": "grid", "parameters": {"bodies": [4, 9]}}],
}
NO_ROWS = [
    *(None, 1.5, b"\xff", "", "{}", "[]", "null", "[" * 100_000, "9" * 5000, '"\\ud800"', "\x00"),
    *("NaN", '{"status": "done"}', '{"key": []}', "[" * 900 + "]" * 900),
]
SQL = [
    *(f"UPDATE rows SET {name} = {{}} WHERE rowid = {{}}" for name in ("key", "course", "content", "digest")),
    *("DROP TABLE rows", "ALTER TABLE rows ADD COLUMN more", "ALTER TABLE rows RENAME TO others", "VACUUM"),
    *("CREATE INDEX more ON rows (course)", "CREATE VIEW more AS SELECT 1", "PRAGMA user_version = {1}"),
    *("CREATE TRIGGER more AFTER INSERT ON rows BEGIN DELETE FROM rows; END", "PRAGMA application_id = {1}"),
    *("PRAGMA journal_mode = WAL", "PRAGMA page_size = 512; VACUUM", "PRAGMA auto_vacuum = 1; VACUUM"),
    "DROP TABLE rows; CREATE VIEW rows AS SELECT 1 AS key, 1 AS course, {0} AS content, 1 AS digest",
    "DROP TABLE rows; CREATE VIEW rows AS SELECT {0} AS key, 1 AS course, {3} AS content, 1 AS digest",
    "PRAGMA writable_schema = 1; UPDATE sqlite_schema SET {2} = {0} WHERE rowid = 1",
]
"""Changes of a file of rows, with room for a value, the number of a row, and a column of the schema."""
VALUES = ["NULL", "1", "'x'", "1e999", "x'ff'", "cast(x'ff' as text)", "zeroblob(20000000)"]


def changed_bytes(rng: random.Random, content: bytes) -> bytes:
    """Content with a few bytes changed, left out or put in, or cut off."""
    for _ in range(rng.randrange(1, 4)):
        at = rng.randrange(len(content) + 1)
        one = bytes([rng.choice([*b'\xff\x00\x1b\n"', rng.randrange(256)])])
        put_in = content[:at] + one * rng.randrange(1, 9) + content[at + rng.randrange(3) :]
        content = rng.choice([put_in, content[:at]]) or b"\x80"
    return content


def flipped(rng: random.Random, content: bytes) -> bytes:
    """Content with one bit that is another."""
    at = rng.randrange(len(content))
    return content[:at] + bytes([content[at] ^ 1 << rng.randrange(8)]) + content[at + 1 :]


def changed_text(rng: random.Random, text: str) -> bytes:
    """TOML with a value replaced, a line left out, repeated or put in; or with other bytes."""
    lines = text.strip().split("\n")
    at = rng.randrange(len(lines))
    key, equals, _ = lines[at].partition("=")
    way = rng.randrange(5)
    if way == 0:
        return changed_bytes(rng, text.encode())
    lines[at : at + 1] = {
        1: [],
        2: [lines[at]] * 2,
        3: [lines[at], rng.choice(lines)],
        4: [f"{key}{equals} {rng.choice(WORDS)}" if equals else rng.choice(WORDS)],
    }[way]
    return "\n".join(lines).encode()


def changed_json(rng: random.Random, value: object) -> object:
    """Plain data with one part replaced, left out or repeated."""
    if isinstance(value, list | dict) and value and rng.random() < 0.9:
        made = value.copy()
        key = rng.choice(list(made) if isinstance(made, dict) else range(len(made)))
        if rng.random() < 0.1:
            del made[key]
        else:
            made[key] = changed_json(rng, made[key])
        return made
    return rng.choice(JSON)


def sealed(arrays: dict[str, np.ndarray], form: int = zipfile.ZIP_STORED, twice: bool = False) -> bytes:
    """An archive of a saved run with the right checksum."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", form) as archive:
        for name, array in arrays.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, array)
            with warnings.catch_warnings(action="ignore", category=UserWarning):  # a name twice
                for _ in range(1 + twice):
                    archive.writestr(zipfile.ZipInfo(f"{name}.npy"), member.getvalue(), compress_type=form)
        archive.comment = bytes(64)
    content = file.getvalue()
    return content[:-64] + hashlib.sha256(content).hexdigest().encode()


def changed_run(rng: random.Random, content: bytes, good: dict[str, np.ndarray]) -> bytes:
    """A saved run with other bytes, another head, or other tables, the checksum right again."""
    way = rng.randrange(6)
    if way == 0:
        return changed_bytes(rng, content)
    arrays = good.copy()
    if way == 1:
        return sealed(arrays, rng.choice([zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED]), rng.random() < 0.5)
    if way in (2, 3):
        head = changed_json(rng, json.loads(arrays[files.MAGIC].tobytes()))
        text = rng.choice([json.dumps(head), "[" * 100_000]) if rng.random() < 0.1 else json.dumps(head)
        arrays[files.MAGIC] = np.frombuffer(text.encode(), np.uint8)
    else:
        name = rng.choice([each for each in arrays if each != files.MAGIC])
        array = arrays[name].copy()
        if way == 4 and array.size:
            raw = bytearray(array.tobytes())
            at = 8 * rng.randrange(max(len(raw) // 8, 1))
            number = struct.pack("<q", rng.choice([-1, 1, 2**63 - 1, -(2**63), rng.randrange(1000)]))
            raw[at : at + 8] = number[: len(raw) - at]
            arrays[name] = np.frombuffer(bytes(raw), array.dtype).reshape(array.shape)
        else:
            of_bytes = array.astype("V1") if array.dtype.names is None else array.view("V1")
            doubled = np.repeat(array, 2, 0) if array.ndim else array
            arrays[name] = rng.choice([array[:-1], of_bytes, np.zeros(3), doubled])
    return sealed(arrays)


def changed_log(rng: random.Random, content: bytes) -> bytes:
    """A log with other bytes, or another text in its first part, the checksum right again."""
    if rng.random() < 0.5:
        return changed_bytes(rng, content)
    lengths = struct.Struct("<QQ")
    first, _ = lengths.unpack_from(content, len(SIGNATURE))
    text = content[len(SIGNATURE) + 16 :][:first]
    other = json.dumps(changed_json(rng, json.loads(text))).encode()
    changed = rng.choice([other, changed_bytes(rng, text), b"[" * 100_000])
    said = lengths.pack(len(changed), 0) + changed
    return SIGNATURE + said + struct.pack("<I", zlib.crc32(said, zlib.crc32(SIGNATURE)))


def change_rows(rng: random.Random, path: Path, row: int, seals: bool) -> None:
    """Changes a file of rows by statements; or one of its rows, the digest right again."""
    with closing(sqlite3.connect(path)) as file, suppress(sqlite3.Error):  # views of gigabytes fail here too
        file.create_function("digest", 3, lambda *values: digest(values))
        if seals:
            (content,) = file.execute("SELECT content FROM rows WHERE rowid = ?", (row,)).fetchone()
            other = json.dumps(changed_json(rng, json.loads(content)))
            values = rng.choice([other, other, rng.choice(NO_ROWS)]), row
            file.execute("UPDATE rows SET content = ? WHERE rowid = ?", values)
            file.execute("UPDATE rows SET digest = digest(key, course, content)")
        else:
            column = rng.choice(["type", "name", "tbl_name", "rootpage", "sql"])
            gigabyte = "hex(zeroblob(450000000))"
            file.executescript(rng.choice(SQL).format(rng.choice(VALUES), row, column, gigabyte))
        file.commit()


def changed_frames(rng: random.Random, text: str) -> bytes:
    lines = text.strip().split("\n")
    at = rng.randrange(len(lines))
    words = lines[at].split(" ")
    words[rng.randrange(len(words))] = rng.choice(["-2", "99999999999", "x", "", *NUMBERS])
    lines[at] = " ".join(words)
    return rng.choice([("\n".join(lines) + "\n").encode(), changed_bytes(rng, text.encode())])


def made_special(rng: random.Random, path: Path) -> None:
    """Something at a path that is no regular file, or nothing, or an empty file."""
    path.unlink(missing_ok=True)
    way = rng.choice(["pipe", "empty", "nothing", "/dev/zero", "/dev/null", path, path.parent])
    if way == "pipe":
        os.mkfifo(path)
    elif way == "empty":
        path.write_bytes(b"")
    elif way != "nothing":
        path.symlink_to(way)


@contextmanager
def within(seconds: int) -> Iterator[None]:
    """Raises TimeoutError after ``seconds``: only a hang takes them."""

    def late(*_: object) -> None:
        raise TimeoutError("it hangs")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def said(line: str, *more: object) -> None:
    """Runs a command: an exit code, and nothing that a terminal would obey."""
    result = kinetile(line, *more)
    for text in (result.stdout, result.stderr):
        assert all(each.isprintable() for each in text.split("\n")), text[:500]


class Malformed:
    """Makes files and streams, and gives them to what reads them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        scene = kt.make_scene("grid", bodies=4, seed=1)
        sim = kt.Simulation(scene, "cells")
        sim.save(folder / "good.kt")
        partial = folder / "good.parquet.partial"
        with kt.EventRecorder(folder / "good.parquet", scene) as recorder:
            self.log = partial.read_bytes()
            sim.run(0.5, recorder=recorder)
        self.events = (folder / "good.parquet").read_bytes()
        self.written_events = kt.read_events(folder / "good.parquet")

        self.study = Study(ROWS, folder / "good.sqlite")
        self.plan = folder / "good.toml"
        self.plan.write_text(
            'phases = ["cells"]\nseeds = 3\nuntil = 0.1\n'
            'scenes = [{ recipe = "grid", parameters = { bodies = [4, 9] } }]\n'
        )
        run_here(self.study)
        self.rows, self.written_rows = self.study.results.read_bytes(), self.study.rows()
        self.run = (folder / "good.kt").read_bytes()
        with np.load(io.BytesIO(self.run)) as archive:
            self.arrays = {name: archive[name] for name in archive.files}
        said("export grid -s bodies=4 --until 0.1 --every 0.1 --to", folder / "good.xyz")
        self.frames = (folder / "good.xyz").read_text()
        with pipe.PipedEngine("cat") as self.engine:  # it has ended when answers are read in its place
            pass
        self.asked = Contacts().exchange(scene, np.zeros(0, kt.CONTACT))
        self.ways: dict[str, Callable[[random.Random], None]] = {
            name.removeprefix("of_"): getattr(self, name) for name in dir(self) if name.startswith("of_")
        }

    def written(self, name: str, content: bytes) -> Path:
        path = self.folder / name
        path.unlink(missing_ok=True)
        path.write_bytes(content)
        return path

    def of_scenes(self, rng: random.Random) -> None:
        for _ in range(20):
            path = self.written("s.toml", changed_text(rng, rng.choice([SCENE, RECIPE])))
            with suppress(SceneError):
                kt.load_scene(path)
        said("run --explain", path)

    def of_cases(self, rng: random.Random) -> None:
        head = f'# {{"check": {rng.choice(WORDS)}, "options": {rng.choice(["[" * 100_000, *WORDS])}}}\n'
        load_case(self.written("c.toml", changed_text(rng, head + SCENE)))

    def of_studies(self, rng: random.Random) -> None:
        read_plan_file(self.written("p.toml", changed_text(rng, STUDY)))

    def of_saved_runs(self, rng: random.Random) -> None:
        kt.resume(self.written("r.kt", changed_run(rng, self.run, self.arrays)), rng.choice([None, "cells"]))

    def of_logs(self, rng: random.Random) -> None:
        said("recover --overwrite", self.written("e.parquet.partial", changed_log(rng, self.log)))

    def of_event_files(self, rng: random.Random) -> None:
        path = self.written("e.parquet", rng.choice([flipped, changed_bytes])(rng, self.events))
        found = kt.read_events(path)
        assert found.rows.tobytes() == self.written_events.rows.tobytes()
        assert found.metadata == self.written_events.metadata
        if rng.random() < 0.1:
            export = "export --until 0.1 --every 0.1 --overwrite --to w.xyz"
            said(rng.choice(["certify-log grid -s bodies=4", "view --out v.html", export]), path)
        Trajectory.read(path).positions(0.25)

    def of_rows(self, rng: random.Random) -> None:
        for left in self.folder.glob("n.sqlite*"):
            left.unlink()
        way, path = rng.randrange(4), self.folder / "n.sqlite"
        self.written(path.name, (flipped, changed_bytes)[way](rng, self.rows) if way < 2 else self.rows)
        if way >= 2:
            change_rows(rng, path, rng.randrange(1, 1 + len(self.written_rows)), way == 3)
        self.study.results, y = path, rng.choice([None, "contacts", "events", "status"])
        if rng.random() < 0.1:
            said("study rows --results", path, self.plan)
            said("study table --results", path, self.plan, *(("--y", y) if y else ()))
        rows = self.study.rows()
        assert way == 3 or rows == self.written_rows
        self.study.status()
        self.study.table(y)

    def of_frames(self, rng: random.Random) -> None:
        kt.make_scene("frame", file=str(self.written("f.xyz", changed_frames(rng, self.frames))))

    def of_contacts(self, rng: random.Random) -> None:
        text = changed_bytes(rng, b"0 1 0 1\n0 2 1 2\nfingerprint " + b"0" * 64 + b"\n")
        said("certify-log grid -s bodies=4", self.written("c.txt", text * rng.choice([1, 1, 2])))

    def of_answers(self, rng: random.Random) -> None:
        good = {"contacts": [[0, 1, 0, 1]]}
        odd = ["[" * 100_000, '{"refused": "\\u001b[31m"}', "9" * 5000, "NaN", "\udcff", "null"]
        line = rng.choice([json.dumps(changed_json(rng, good)), *odd])
        came = SimpleQueue[bytes]()
        came.put(line.encode(errors="surrogateescape") + b"\n")
        cast(Any, self.engine).program = SimpleNamespace(send=lambda _: None, came=came)
        self.engine.answer(self.asked)

    def of_words(self, rng: random.Random) -> None:
        word = rng.choice([*NUMBERS, "true", "[]", "1e-9", "1e-300"])
        export = "export grid -s bodies=4 --until 0.1 --overwrite --to"
        lines: list[tuple[object, ...]] = [
            (export, self.folder / "w.xyz", f"--every={word}"),
            ("run grid --explain -o", f"spacing={rng.choice(WORDS)}"),
            ("run grid --explain -s", f"bodies={word}"),
        ]
        said(*rng.choice(lines))

    def of_special_files(self, rng: random.Random) -> None:
        name, *commands = rng.choice(
            [
                ("x.toml", "run --explain", "view --out v.html", "study run"),
                ("x.kt", "resume --until 1"),
                ("x.parquet", "view --out v.html", "certify-log grid"),
                ("x.parquet.partial", "recover"),
                ("x.xyz", "run frame --explain -s"),
                ("x.txt", "certify-log grid"),
                ("x.sqlite", "study rows good.toml --results", "study table good.toml --results"),
            ]
        )
        path = self.folder / name
        made_special(rng, path)
        said(rng.choice(commands), f"file={path}" if path.suffix == ".xyz" else path)
        path.unlink(missing_ok=True)


def tried(malformed: Malformed, ways: Sequence[str], many: int) -> Counter[tuple[str, bool]]:
    """Returns how many cases of each way were read, and how many were refused in a sentence."""
    counts: Counter[tuple[str, bool]] = Counter()
    for case in range(many):
        rng = random.Random(case)
        way = rng.choice(ways)
        try:
            with within(60), suppress(KinetileError, FileNotFoundError):
                counts[way, False] += 1
                malformed.ways[way](rng)
                counts.update({(way, False): -1, (way, True): 1})
        except BaseException as error:
            error.add_note(f"case {case}, {way}")
            raise
    return counts


def test_what_is_malformed_is_refused_in_a_sentence(tmp_path, monkeypatch):
    """JSON that is nested deeply, numbers beyond 64 bits, bytes that are not UTF-8, a pipe in place of a
    file: each ended in a traceback, or did not end."""
    monkeypatch.chdir(tmp_path)
    malformed = Malformed(tmp_path)
    tried(malformed, sorted(malformed.ways), int(os.environ.get("KINETILE_MALFORMED", "100")))
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < 2_000_000
