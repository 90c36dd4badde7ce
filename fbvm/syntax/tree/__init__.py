"""The tree of a source text: `tree.Assign`, `tree.Binary` and so on, named as the productions of IEC 61131-3 Annex A.

Nodes of ladder and of sequential function charts have modules of their own, `tree.ladder` and `tree.sfc`."""

from fbvm.syntax.tree.expressions import *  # noqa: F403
from fbvm.syntax.tree.node import Node as Node
from fbvm.syntax.tree.nodes import *  # noqa: F403
