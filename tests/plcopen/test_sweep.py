"""The sweeps over folders: what they count, and the causes that they name."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import pytest
from drawings import RAIL, coil, contact, document, pou

HERE = Path(__file__).parent


def script(path: Path) -> Any:
    """A script as a module; two of them have one name."""
    spec = importlib.util.spec_from_file_location(f"{path.parent.name}_sweep", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_documents_are_counted_by_how_far_they_come(tmp_path: Path) -> None:
    (tmp_path / "good.xml").write_bytes(document(pou(RAIL + contact(2, "1", "a") + coil(3, "2", "b"), "a b")))
    (tmp_path / "lacking.xml").write_bytes(document(pou(RAIL + coil(3, "1", "c"), "a b")))
    (tmp_path / "none.xml").write_text("<other/>", encoding="utf-8")
    (tmp_path / "part.xml").write_bytes(document(pou(RAIL + coil(3, "1", "a"), "a b"), pou("", kind="other", name="Lost")))
    made = script(HERE / "sweep.py").sweep(tmp_path, "standard")
    assert made.reached == {"found": 4, "imported": 2, "checked": 1, "run": 1, "equal": 1}
    causes = {stage: names for (stage, _), names in sorted(made.causes.items())}
    assert causes == {"checked": ["lacking.xml"], "imported": ["part.xml"]}
    assert made.report().splitlines()[0] == "found 4, imported 2, checked 1, run 1, equal 1"


@pytest.mark.slow
def test_sources_are_counted_by_how_far_they_come(tmp_path: Path) -> None:
    for name, body in (("good", "n := n + 1;"), ("stops", "n := 1 / n;"), ("wrong", "n := m;"), ("unread", "n := ;")):
        (tmp_path / f"{name}.st").write_text(f"PROGRAM Main VAR n : INT; END_VAR {body} END_PROGRAM", encoding="utf-8")
    made = script(HERE.parent / "lang" / "sweep.py").sweep(tmp_path)
    assert made.reached == {"found": 4, "read": 3, "checked": 2, "run": 1, "equal": 1}
    assert made.causes[("run", "R0101")] == ["stops.st"]
