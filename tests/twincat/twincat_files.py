"""Files of TwinCAT of our own making."""

from __future__ import annotations

from pathlib import Path

HEAD = '\ufeff<?xml version="1.0" encoding="utf-8"?>\n<TcPlcObject Version="1.1.0.1" ProductVersion="3.1.4024.12">\n'
COUNTER = HEAD + """  <POU Name="FB_Counter" Id="{1}" SpecialFunc="None">
    <Declaration><![CDATA[// counts
FUNCTION_BLOCK FB_Counter
VAR
    nCount : INT;
END_VAR]]></Declaration>
    <Implementation>
      <ST><![CDATA[nCount := nCount + 1; // once a call]]></ST>
    </Implementation>
    <Method Name="Reset" Id="{2}">
      <Declaration><![CDATA[METHOD PUBLIC Reset : BOOL
VAR_INPUT
    n : INT;
END_VAR
]]></Declaration>
      <Implementation>
        <ST><![CDATA[nCount := n;
Reset := TRUE;]]></ST>
      </Implementation>
    </Method>
    <Property Name="Count" Id="{3}">
      <Declaration><![CDATA[PROPERTY Count : INT]]></Declaration>
      <Get Name="Get" Id="{4}">
        <Declaration><![CDATA[VAR
END_VAR
]]></Declaration>
        <Implementation>
          <ST><![CDATA[Count := nCount;]]></ST>
        </Implementation>
      </Get>
    </Property>
    <Action Name="Stop" Id="{5}">
      <Implementation><ST>nCount := SEL(nCount &lt; 5, 0, nCount);</ST></Implementation>
    </Action>
    <LineIds Name="FB_Counter"><LineId Id="1" Count="0" /></LineIds>
  </POU>
</TcPlcObject>
"""
MAIN = HEAD + """  <POU Name="MAIN" Id="{6}">
    <Declaration><![CDATA[PROGRAM MAIN
VAR
    fbCounter : FB_Counter;
    nSeen : INT;
    stPoint : ST_Point;
END_VAR
]]></Declaration>
    <Implementation>
      <ST><![CDATA[fbCounter();
nSeen := nSeen + 1;
stPoint.nX := nSeen;
GVL_Plant.nScans := GVL_Plant.nScans + 1;
]]></ST>
    </Implementation>
  </POU>
</TcPlcObject>
"""
POINT = HEAD + """  <DUT Name="ST_Point" Id="{7}">
    <Declaration><![CDATA[TYPE ST_Point :
STRUCT
    nX : INT;
END_STRUCT
END_TYPE
]]></Declaration>
  </DUT>
</TcPlcObject>
"""
PLANT = HEAD + """  <GVL Name="GVL_Plant" Id="{8}">
    <Declaration><![CDATA[{attribute 'qualified_only'}
VAR_GLOBAL
    nScans : DINT;
END_VAR
]]></Declaration>
  </GVL>
</TcPlcObject>
"""
TASK = HEAD + """  <Task Name="PlcTask" Id="{9}">
    <CycleTime>20000</CycleTime>
    <Priority>20</Priority>
    <PouCall>
      <Name>MAIN</Name>
    </PouCall>
    <TaskFBGuid>{10}</TaskFBGuid>
  </Task>
</TcPlcObject>
"""
PROJECT = """<?xml version="1.0" encoding="utf-8"?>
<Project DefaultTargets="Build" xmlns="http://schemas.microsoft.com/developer/msbuild/2003">
  <PropertyGroup><Name>Plant</Name></PropertyGroup>
  <ItemGroup>
    <Compile Include="PlcTask.TcTTO"><SubType>Code</SubType></Compile>
    <Compile Include="POUs\\MAIN.TcPOU"><SubType>Code</SubType></Compile>
    <Compile Include="POUs\\FB_Counter.TcPOU"><SubType>Code</SubType></Compile>
    <Compile Include="DUTs\\ST_Point.TcDUT"><SubType>Code</SubType></Compile>
    <Compile Include="GVLs\\GVL_Plant.TcGVL"><SubType>Code</SubType></Compile>
    <Compile Include="POUs\\Old.TcPOU"><ExcludeFromBuild>true</ExcludeFromBuild></Compile>
    <Compile Include="VISUs\\Page.TcVIS"><SubType>Code</SubType></Compile>
  </ItemGroup>
  <ItemGroup>
    <PlaceholderReference Include="Tc2_Standard">
      <DefaultResolution>Tc2_Standard, * (Beckhoff Automation GmbH)</DefaultResolution>
    </PlaceholderReference>
  </ItemGroup>
</Project>
"""
FILES = {"PlcTask.TcTTO": TASK, "POUs/MAIN.TcPOU": MAIN, "POUs/FB_Counter.TcPOU": COUNTER, "DUTs/ST_Point.TcDUT": POINT,
         "GVLs/GVL_Plant.TcGVL": PLANT, "Plant.plcproj": PROJECT}  # fmt: skip


def write_project(folder: Path) -> Path:
    """Writes the project into a folder; the path of its `.plcproj`."""
    for name, text in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(text.replace("\n", "\r\n").encode())
    return folder / "Plant.plcproj"


AXIS = HEAD + """  <POU Name="FB_Axis" Id="{11}">
    <Declaration><![CDATA[FUNCTION_BLOCK FB_Axis
VAR_OUTPUT
    aSteps : ARRAY[1..Param.nSteps] OF INT;
    nLast : INT;
END_VAR
]]></Declaration>
    <Implementation>
      <ST><![CDATA[nLast := Param.nSteps; aSteps[5] := 7;]]></ST>
    </Implementation>
  </POU>
</TcPlcObject>
"""
PARAM = HEAD + """  <GVL Name="Param" Id="{12}" ParameterList="True">
    <Declaration><![CDATA[{attribute 'qualified_only'}
VAR_GLOBAL CONSTANT
    nSteps : INT := 3; // of an axis
END_VAR
]]></Declaration>
  </GVL>
</TcPlcObject>
"""
CORE = """<?xml version="1.0" encoding="utf-8"?>
<Project xmlns="http://schemas.microsoft.com/developer/msbuild/2003">
  <PropertyGroup><Name>CoreProject</Name><Title>Core</Title><DefaultNamespace>Core</DefaultNamespace></PropertyGroup>
  <ItemGroup>
    <Compile Include="FB_Axis.TcPOU"/><Compile Include="Param.TcGVL"/><Compile Include="PlcTask.TcTTO"/>
  </ItemGroup>
</Project>
"""
LINE_MAIN = HEAD + """  <POU Name="MAIN" Id="{13}">
    <Declaration><![CDATA[PROGRAM MAIN
VAR
    fbAxis : Core.FB_Axis;
END_VAR
]]></Declaration>
    <Implementation><ST><![CDATA[fbAxis();]]></ST></Implementation>
  </POU>
</TcPlcObject>
"""
LINE = """<?xml version="1.0" encoding="utf-8"?>
<Project xmlns="http://schemas.microsoft.com/developer/msbuild/2003">
  <PropertyGroup><Name>Line</Name></PropertyGroup>
  <ItemGroup><Compile Include="MAIN.TcPOU"/><Compile Include="PlcTask.TcTTO"/></ItemGroup>
  <ItemGroup>
    <PlaceholderReference Include="Core">
      <DefaultResolution>Core, * (us)</DefaultResolution><Namespace>Core</Namespace>
      <Parameters><Parameter ListName="Param"><Key>NSTEPS</Key><Value>5</Value></Parameter></Parameters>
    </PlaceholderReference>
    <PlaceholderReference Include="Tc2_Standard"/>
  </ItemGroup>
</Project>
"""


def write_solution(folder: Path) -> Path:
    """Writes a solution of two projects, of which Line uses Core; the path of Line."""
    files = {"Line/Line.plcproj": LINE, "Line/MAIN.TcPOU": LINE_MAIN, "Line/PlcTask.TcTTO": TASK, "Core/Core.plcproj": CORE,
             "Core/FB_Axis.TcPOU": AXIS, "Core/Param.TcGVL": PARAM, "Core/PlcTask.TcTTO": TASK, "All.sln": ""}  # fmt: skip
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    return folder / "Line" / "Line.plcproj"


AXIS_TEST = HEAD + """  <POU Name="FB_Axis_Test" Id="{21}">
    <Declaration><![CDATA[FUNCTION_BLOCK FB_Axis_Test EXTENDS TcUnit.FB_TestSuite
VAR
    fbAxis : Core.FB_Axis;
END_VAR
]]></Declaration>
    <Implementation>
      <ST><![CDATA[TEST('steps'); fbAxis(); AssertEquals_INT(5, fbAxis.nLast, 'last'); TEST_FINISHED();]]></ST>
    </Implementation>
  </POU>
</TcPlcObject>
"""
TEST_PROGRAM = HEAD + """  <POU Name="PRG_TEST" Id="{22}">
    <Declaration><![CDATA[PROGRAM PRG_TEST
VAR
    fbTest : FB_Axis_Test;
END_VAR
]]></Declaration>
    <Implementation><ST><![CDATA[TcUnit.RUN();]]></ST></Implementation>
  </POU>
</TcPlcObject>
"""


def write_tested_solution(folder: Path) -> Path:
    """As `write_solution`, but Line has a suite for a block of Core."""
    line = write_solution(folder)
    project = LINE.replace('"MAIN.TcPOU"/>', '"PRG_TEST.TcPOU"/><Compile Include="FB_Axis_Test.TcPOU"/>')
    files = {"FB_Axis_Test.TcPOU": AXIS_TEST, "PRG_TEST.TcPOU": TEST_PROGRAM, "Line.plcproj": project,
             "PlcTask.TcTTO": TASK.replace("MAIN", "PRG_TEST")}  # fmt: skip
    for name, text in files.items():
        (line.parent / name).write_text(text, encoding="utf-8")
    return line
