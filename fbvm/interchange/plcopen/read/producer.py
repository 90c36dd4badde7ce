"""Which tool wrote a document, and how that tool executes drawings.

The header names a family of tools, never the version, and who runs a document may have another version than who saved it.  So
hints tell which order is likely, and the import warns where another order of the family would do something else.

Sources: `PLCGenerator.py` of Beremiz, OpenPLC Editor and xml2st with their histories; headers of 205 published documents.
"""

from __future__ import annotations

from dataclasses import dataclass

from fbvm.interchange.markup import Element

NETWORK, IDS = "network", "ids"
SINKS_BY_POSITION, SINKS_AS_WRITTEN, ALL_BY_POSITION = "beremiz1", "document", "position"
ORDERS = {
    NETWORK: "networks from top to bottom, in each of them producers in front of consumers; each element once",
    SINKS_BY_POSITION: "Beremiz until October 2022: outputs from top to bottom, each after what it needs; then blocks",
    SINKS_AS_WRITTEN: "Beremiz and OpenPLC Editor since then: outputs as they stand in the document; then blocks",
    ALL_BY_POSITION: "OpenPLC Editor since October 2025: outputs and blocks together, from top to bottom",
    IDS: "outputs and blocks by executionOrderId, else as they stand in the document",
}
"""Orders of evaluation, and what each means."""
BY_NUMBER = "number"
"""The order of a CFC, whose outputs and blocks all have a number.  Nobody chooses it."""
GENERATED = (SINKS_AS_WRITTEN, SINKS_BY_POSITION, ALL_BY_POSITION)
"""The orders that Beremiz and OpenPLC Editor have had."""
GIVEN = "it was given"
"""Why an order is taken that somebody asked for."""
_UNNAMED = frozenset((
    "unknown", "unnamed", "unbekannt", "unbenannt", "desconocido", "sin nombre", "desconhecido", "sem nome", "inconnu", "sansnom",
    "sans nom", "sconosciuto", "senza nome", "неизвестно", "неизвестный", "безымянный", "neznámo",
    "未知", "未命名", "不明", "名称未設定"))
"""What Beremiz and OpenPLC Editor write as company and product, in the language of the desktop."""
_USUAL = {"Config0": "Res0", "config": "resource1"}
"""Configuration and resource of a new project in Beremiz and OpenPLC Editor."""
_NAMED = {"twincat": ("twincat",), "codesys": ("codesys", "e!cockpit", "machine expert", "somachine"),
          "beremiz": ("beremiz", "openplc"), "fbvm": ("fbvm",)}
"""Families, and words of headers that name one of their tools."""
_GENERATION_2, _GENERATION_3 = "2022-06", "2025-10-03"
"""Dates from which documents were probably meant for the second and third generation of the generator."""


@dataclass(frozen=True)
class Producer:
    """The family of tools that wrote a document: "beremiz" (OpenPLC Editor too), "codesys", "twincat", "fbvm", or "" if that is
    not known; the order of evaluation that is taken, and from what that was concluded."""

    family: str
    order: str
    because: str

    @property
    def generates(self) -> bool:
        """Whether drawings are executed as the generator of Beremiz and OpenPLC Editor writes them as text."""
        return self.order in GENERATED


def producer(root: Element, is_declared_twice: bool, order: str = "") -> Producer:
    """The producer of a document.  `is_declared_twice` says that the namespace is bound to the prefix ns1, too; an `order` that
    is given is taken."""
    family, because = _family(root)
    if order:
        return Producer(family, order, GIVEN)
    if family != "beremiz":
        return Producer(family, NETWORK, because)
    found, hint = _generation(root, is_declared_twice)
    return Producer(family, found, f"{because}, {hint}")


def _family(root: Element) -> tuple[str, str]:
    header = root.one("fileHeader")
    company, product = ((header.get(name).strip() for name in ("companyName", "productName")) if header else ("", ""))
    said = f"{company} {product}".casefold()
    for family, words in _NAMED.items():
        if any(word in said for word in words):
            return family, f"the header names {product or company}"
    unnamed = [name for name in (company, product) if name.casefold() in _UNNAMED]
    if unnamed:
        return "beremiz", f"the header says {' and '.join(unnamed)}, as Beremiz and OpenPLC Editor write it"
    for one in root.walk():
        resource = _USUAL.get(one.get("name")) if one.name == "configuration" else None
        if resource and any(part.get("name") == resource for part in one.all("resource")):
            return "beremiz", f"it has a {one.get('name')} with a {resource}, as Beremiz and OpenPLC Editor name them"
    return "", "the header names no known tool"


def _generation(root: Element, is_declared_twice: bool) -> tuple[str, str]:
    """The order that a document of Beremiz or OpenPLC Editor was probably drawn for, and the hint that says so."""
    if any(element.name in ("block", "outVariable", "inOutVariable") and (number := element.get("executionOrderId")).isdecimal()
           and number.strip("0") for element in root.walk()):
        return SINKS_AS_WRITTEN, "and elements have an executionOrderId"
    content = root.one("contentHeader")
    date = content.get("modificationDateTime") if content else ""
    scalings = {(element.get("x"), element.get("y")) for element in root.walk() if element.name == "scaling"}
    if is_declared_twice and scalings <= {("16", "16")}:
        late = not date or date >= _GENERATION_3
        return (ALL_BY_POSITION if late else SINKS_AS_WRITTEN), "and the newer OpenPLC editor has written it"
    if not root.namespace.rstrip("/").endswith(("tc6_0200", "tc6_0201")):
        return SINKS_BY_POSITION, "and it is of TC6 1.x"
    if date and date < _GENERATION_2:
        return SINKS_BY_POSITION, f"and it was changed on {date[:10]}"
    return SINKS_AS_WRITTEN, f"and it was changed on {date[:10]}" if date else "and it has no date"
