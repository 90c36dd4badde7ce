"""Tests here use the rigs of the unit tests and of the language corpus."""

from __future__ import annotations

import sys
from pathlib import Path

TESTS = Path(__file__).parent.parent
sys.path[:0] = [str(TESTS / "unit"), str(TESTS / "lang")]
