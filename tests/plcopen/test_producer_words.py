"""Which tool wrote a document, and which order of evaluation that means."""

from __future__ import annotations

from rows import each_of

from fbvm.base.diagnostics import Diagnostic
from fbvm.interchange.markup import parse_markup
from fbvm.interchange.plcopen.read.producer import (
    ALL_BY_POSITION,
    GENERATED,
    GIVEN,
    IDS,
    NETWORK,
    SINKS_AS_WRITTEN,
    SINKS_BY_POSITION,
    Producer,
    producer,
)

NEW, OLD = "http://www.plcopen.org/xml/tc6_0201", "http://www.plcopen.org/xml/tc6.xsd"


def found(company: str = "", product: str = "", *, body: str = "", date: str = "", space: str = NEW, twice: bool = False,
          order: str = "") -> Producer:  # fmt: skip
    changed = f' modificationDateTime="{date}"' if date else ""
    made = parse_markup((f'<project xmlns="{space}"><fileHeader companyName="{company}" productName="{product}"/>'
                         f"<contentHeader{changed}>{body}</contentHeader></project>").encode(), "x.xml")  # fmt: skip
    assert not isinstance(made, Diagnostic)
    return producer(made[1], twice, order)


@each_of(("company", "product", "family", "because"), (
    ("Beckhoff", "TwinCAT PLC Control", "twincat", "the header names TwinCAT PLC Control"),
    ("3S", "CODESYS", "codesys", "the header names CODESYS"), ("WAGO", "e!COCKPIT", "codesys", "the header names e!COCKPIT"),
    ("Schneider", "Machine Expert", "codesys", "the header names Machine Expert"),
    ("SoMachine", "", "codesys", "the header names SoMachine"), ("", "FBVM 0.2", "fbvm", "the header names FBVM 0.2"),
    ("Someone", "else", "", "the header names no known tool"), ("", "", "", "the header names no known tool")))  # fmt: skip
def test_a_tool_that_names_itself_is_known_by_words_of_the_header(company: str, product: str, family: str, because: str) -> None:
    assert found(company, product) == Producer(family, NETWORK, because)
    assert found(f" {company} ", product, order=IDS) == Producer(family, IDS, GIVEN)


BEREMIZ = "the header says Unknown and Unnamed, as Beremiz and OpenPLC Editor write it"


@each_of(("options", "order", "because"), (
    ({"body": '<outVariable executionOrderId="3"/>'}, SINKS_AS_WRITTEN, "elements have an executionOrderId"),
    ({"body": '<block executionOrderId="10"/>', "date": "2020-01-01"}, SINKS_AS_WRITTEN, "elements have an executionOrderId"),
    ({"body": '<inOutVariable executionOrderId="1"/>', "space": OLD}, SINKS_AS_WRITTEN, "elements have an executionOrderId"),
    ({"body": '<block executionOrderId="0"/>'}, SINKS_AS_WRITTEN, "it has no date"),
    ({"body": '<block executionOrderId="00"/>', "space": OLD}, SINKS_BY_POSITION, "it is of TC6 1.x"),
    ({"body": '<contact executionOrderId="3"/>', "space": OLD}, SINKS_BY_POSITION, "it is of TC6 1.x"),
    ({"twice": True}, ALL_BY_POSITION, "the newer OpenPLC editor has written it"),
    ({"twice": True, "date": "2025-10-03T00:00:00"}, ALL_BY_POSITION, "the newer OpenPLC editor has written it"),
    ({"twice": True, "date": "2025-10-02T23:59:59"}, SINKS_AS_WRITTEN, "the newer OpenPLC editor has written it"),
    ({"twice": True, "body": '<scaling x="16" y="16"/>'}, ALL_BY_POSITION, "the newer OpenPLC editor has written it"),
    ({"twice": True, "body": '<scaling x="16" y="10"/>'}, SINKS_AS_WRITTEN, "it has no date"),
    ({"date": "2025-10-03T00:00:00"}, SINKS_AS_WRITTEN, "it was changed on 2025-10-03"),
    ({"date": "2022-06-01T10:00:00"}, SINKS_AS_WRITTEN, "it was changed on 2022-06-01"),
    ({"date": "2022-05-31T10:00:00"}, SINKS_BY_POSITION, "it was changed on 2022-05-31"),
    ({"space": OLD, "date": "2024-01-01T10:00:00"}, SINKS_BY_POSITION, "it is of TC6 1.x"),
    ({"space": NEW + "/"}, SINKS_AS_WRITTEN, "it has no date"),
    ({"space": "http://www.plcopen.org/xml/tc6_0200"}, SINKS_AS_WRITTEN, "it has no date")))  # fmt: skip
def test_the_generation_of_beremiz_is_concluded(options: dict[str, object], order: str, because: str) -> None:
    assert found("Unknown", "Unnamed", **options) == Producer("beremiz", order, f"{BEREMIZ}, and {because}")  # type: ignore[arg-type]


def test_beremiz_is_known_by_words_in_any_language_and_by_its_usual_names() -> None:
    assert found("Unknown", "x").because.startswith("the header says Unknown, as Beremiz")
    assert found("x", "未命名").because.startswith("the header says 未命名, as Beremiz")
    assert found("Beremiz", "").because == "the header names Beremiz, and it has no date"
    for name, resource in (("Config0", "Res0"), ("config", "resource1")):
        made = found("x", "y", body=f'<configuration name="{name}"><resource name="{resource}"/></configuration>')
        assert (made.family, made.order, made.generates) == ("beremiz", SINKS_AS_WRITTEN, True)
        assert made.because == f"it has a {name} with a {resource}, as Beremiz and OpenPLC Editor name them, and it has no date"
    for body in ('<configuration name="Config0"><resource name="resource1"/></configuration>', '<configuration name="c"/>',
                 '<other name="Config0"><resource name="Res0"/></other>'):  # fmt: skip
        made = found("x", "y", body=body)
        assert (made.family, made.generates, made.because) == ("", False, "the header names no known tool")


def test_only_orders_that_the_generator_has_had_are_generated() -> None:
    made = {order: Producer("", order, "").generates for order in (*GENERATED, NETWORK, IDS)}
    assert made == {SINKS_AS_WRITTEN: True, SINKS_BY_POSITION: True, ALL_BY_POSITION: True, NETWORK: False, IDS: False}
