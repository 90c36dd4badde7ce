"""Nodes of a tree: made by place or by name, compared by identity, copied and changed without touching the old ones."""

from __future__ import annotations

import pickle

import pytest

from fbvm.syntax import tree
from fbvm.syntax.tree import ladder, sfc
from fbvm.syntax.tree.node import Node, changed, copied, names_of, node, walk

CLASSES = [each for module in (tree, ladder, sfc) for each in vars(module).values()
           if isinstance(each, type) and issubclass(each, Node)]


def test_parts_are_given_in_order_or_by_name_and_some_need_not_be() -> None:
    by_place = tree.VarSection(1, 2, "VAR", (), ())
    by_name = tree.VarSection(role="step", variables=(), qualifiers=(), kind="VAR", end=2, start=1)
    assert (by_place.hidden, by_place.role, by_name.role) == (False, "", "step")
    assert names_of(by_place) == ("start", "end", "kind", "qualifiers", "variables", "hidden", "role")
    assert repr(by_place) == "VarSection(start=1, end=2, kind='VAR', qualifiers=(), variables=(), hidden=False, role='')"
    with pytest.raises(TypeError, match="missing 1 required positional argument: 'variables'"):
        tree.VarSection(1, 2, "VAR", ())  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="unexpected keyword argument 'colour'"):
        tree.Empty(1, 2, colour=3)  # type: ignore[call-arg]


def test_two_are_never_equal_and_none_takes_more_than_its_parts() -> None:
    one, other = tree.Exit(1, 2), tree.Exit(1, 2)
    assert one == one and one != other and len({one, other}) == 2
    with pytest.raises(AttributeError):
        one.fact = 1  # type: ignore[attr-defined]


def test_a_changed_one_and_a_copy_are_others() -> None:
    name = tree.NameRef(3, 4, "x")
    statement = tree.Return(1, 4, name)
    later = changed(statement, end=9)
    assert (later.start, later.end, later.value, statement.end) == (1, 9, name, 4)
    again = copied((statement,))
    assert again[0].value is not name and again[0].value.text == "x"
    assert [type(each) for each in walk(again)] == [tree.Return, tree.NameRef]
    assert repr(pickle.loads(pickle.dumps(statement))) == repr(statement)


def test_each_class_takes_all_of_its_parts() -> None:
    assert len(CLASSES) > 60
    for each in CLASSES:
        names: tuple[str, ...] = vars(each)["__match_args__"]
        made = each(**{name: number for number, name in enumerate(names)})
        assert [getattr(made, name) for name in names_of(made)] == list(range(len(names)))
        assert names[:2] == ("start", "end") and not hasattr(made, "__dict__")


def test_what_a_class_inherits_comes_first_and_keeps_its_default() -> None:
    @node
    class Base(Node):
        text: str = "a"

    @node
    class More(Base):
        number: int = 5

        def shown(self) -> str:
            return f"{self.text}{self.number}"

    assert [More(0, 0).shown(), More(0, 0, "b").shown(), More(0, 0, number=7).shown()] == ["a5", "b5", "a7"]
