"""What the schema of TC6 2.01 demands of the elements that we write: order of children, attributes that must be there.

A row: element, attributes that it must have, attributes that it may have, children in their order; `*` behind a child
that may repeat, `!` behind one that must be there.  Elements that are not listed hold text or are empty.
"""

from __future__ import annotations

from fbvm.interchange.markup import Element

_OBJECT = "localId | height width executionOrderId negated edge storage"
_TYPE = ("BOOL BYTE WORD DWORD LWORD SINT INT DINT LINT USINT UINT UDINT ULINT REAL LREAL TIME DATE DT TOD string wstring ANY "
         "ANY_DERIVED ANY_ELEMENTARY ANY_MAGNITUDE ANY_NUM ANY_REAL ANY_INT ANY_BIT ANY_STRING ANY_DATE array derived enum "
         "struct subrangeSigned subrangeUnsigned pointer")
_DATA = "text Inheritance AccessModifiers Attributes Method* Property* Interface InputAssignments ObjectId ProjectStructure"
_PINS = "inputVariables! inOutVariables! outputVariables!"
_LISTS = "localVars tempVars inputVars outputVars inOutVars externalVars globalVars"
_MARKS = "| name constant retain nonretain persistent"
_ROWS = f"""
project | | fileHeader! contentHeader! types! instances! addData
fileHeader | companyName productName productVersion creationDateTime |
contentHeader | name | modificationDateTime | coordinateInfo!
coordinateInfo | | fbd! ld! sfc!
scaling | x y |
types | | dataTypes! pous!
dataType | name | baseType! initialValue addData
pou | name pouType | interface actions transitions body addData
interface | | returnType {_LISTS.replace(" ", "* ")}* addData
variable | | type initialValue addData documentation connectionPointIn connectionPointOut
instances | | configurations!
configuration | name | resource* globalVars* accessVars configVars
accessVars | | accessVariable*
configVars | | configVariable*
accessVariable | alias instancePathAndName | direction | type!
configVariable | instancePathAndName | address | type! initialValue
resource | name | task* globalVars* pouInstance*
task | name priority | interval single | pouInstance*
pouInstance | name typeName |
array | | dimension* baseType!
dimension | lower upper |
range | lower upper |
derived | name |
enum | | values! baseType
subrangeSigned | | range! baseType!
subrangeUnsigned | | range! baseType!
pointer | | baseType!
comment | localId height width | position! content!
leftPowerRail | localId | height width | position! connectionPointOut*
rightPowerRail | localId | height width | position! connectionPointIn*
contact | {_OBJECT} | position! connectionPointIn connectionPointOut variable!
coil | {_OBJECT} | position! connectionPointIn connectionPointOut variable!
inVariable | {_OBJECT} | position! connectionPointOut expression!
outVariable | {_OBJECT} | position! connectionPointIn expression!
block | localId typeName | instanceName height width executionOrderId | position! {_PINS} addData
step | localId name | initialStep height width | position! connectionPointIn connectionPointOut connectionPointOutAction
transition | localId | priority | position! connectionPointIn connectionPointOut condition
selectionDivergence | localId | | position! connectionPointIn connectionPointOut*
simultaneousDivergence | localId | | position! connectionPointIn connectionPointOut*
simultaneousConvergence | localId | | position! connectionPointIn* connectionPointOut
jumpStep | localId targetName | | position! connectionPointIn
actionBlock | localId | height width | position! connectionPointIn action*
connectionPointIn | | relPosition connection*
connection | refLocalId | formalParameter | position*
position | x y |
relPosition | x y |
addData | | data*
data | name handleUnknown | {_DATA}
Inheritance | | Extends* Implements*
Attributes | | Attribute*
Attribute | Name Value |
Method | name | ObjectId | interface! body
Property | name | ObjectId | interface! GetAccessor SetAccessor
ProjectStructure | | Object*
Object | Name ObjectId | Object*
Interface | name | ObjectId | Methods Properties Inheritance addData
InputAssignments | | InputAssignment*
InputAssignment | | Name Value!
"""
COORDINATES = {"x", "y", "height", "width"}


def _row(line: str) -> tuple[str, list[str], list[str] | None, list[str]]:
    name, must, *rest = [part.strip() for part in line.split("|")]
    may = rest[0].split() if len(rest) > 1 else []
    return name, must.split(), may, rest[-1].split() if rest else []


RULES = {row[0]: row[1:] for row in map(_row, filter(None, _ROWS.splitlines()))}


def breaches(root: Element) -> list[str]:
    """What breaks the rules of the schema."""
    return [f"{element.name}: {what}" for element in root.walk() for what in _element(element)]


def _element(element: Element) -> list[str]:
    name = element.name
    wrong = [f"{key} is {value!r}, no number" for key, value in element.attributes.items()
             if key in COORDINATES and not value.isdigit()]
    if name in ("type", "baseType", "returnType"):
        unnamed = ("enum", "subrangeSigned", "subrangeUnsigned") if name == "type" else ()
        return wrong + [f"holds {child.name}" for child in element.children
                        if child.name not in _TYPE.split() or child.name in unnamed]
    if name not in RULES or (name == "transition" and element.one("body")):
        return wrong
    must, may, children = RULES[name]
    if name == "simultaneousConvergence":
        wrong += [f"{len(point.all('connection'))} wires reach one point of it" for point in element.all("connectionPointIn")
                  if len(point.all("connection")) != 1]
        wrong += ["its connectionPointOut names a pin" for point in element.all("connectionPointOut") if point.attributes]
    wrong += [f"has no {key}" for key in must if key not in element.attributes]
    if may:
        wrong += [f"has {key}" for key in element.attributes if key not in (*must, *may)]
    order = [child.rstrip("*!") for child in children]
    found = [child.name for child in element.children]
    wrong += [f"holds {child}" for child in found if child not in order]
    if name not in ("interface", "Property"):
        places = [order.index(child) for child in found if child in order]
        wrong += ["its children are in another order"] if places != sorted(places) else []
    wrong += [f"has no <{child[:-1]}>" for child in children if child.endswith("!") and child[:-1] not in found]
    once = [child.rstrip("!") for child in children if not child.endswith("*")]
    return wrong + [f"has {found.count(child)} <{child}>" for child in once if found.count(child) > 1]


def wires_lead_somewhere(root: Element) -> list[str]:
    """Wires of graphical bodies from elements that are not there, and numbers that are there twice."""
    wrong = []
    for body in (inner for inner in root.walk() if inner.name in ("LD", "FBD")):
        numbers = [child.get("localId") for child in body.children]
        wrong += [f"localId {number} twice" for number in set(numbers) if numbers.count(number) > 1]
        wrong += [f"wire from {wire.get('refLocalId')}" for wire in body.walk()
                  if wire.name == "connection" and wire.get("refLocalId") not in numbers]
    return wrong
