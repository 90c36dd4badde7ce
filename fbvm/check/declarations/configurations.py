"""Configurations: which program instances exist, and the tasks that run them (IEC 61131-3 ed. 3, tables 62 and 63)."""

from __future__ import annotations

from fbvm.base.diagnostics import Source
from fbvm.base.dialects import takers
from fbvm.base.types import BOOL, TIME, UINT, StructType, Type, base, fold
from fbvm.check.expressions.scope import Scope
from fbvm.check.symbols.config_facts import Run, TaskFact
from fbvm.check.symbols.context import Context
from fbvm.check.symbols.facts import Pou, Variable
from fbvm.syntax import tree
from fbvm.syntax.parser import parse

LOWEST = 65536
"""Priority of what runs without a task: below every task."""


class Configurations:
    """Chooses the programs that run, and makes their instances and tasks."""

    def __init__(self, context: Context) -> None:
        self.context = context
        self.project = context.project
        self.report = context.project.report
        self._run: list[Variable] = []
        """Instances of programs that a task runs."""

    def choose(self, wanted: str | None, program: str | None) -> tree.Resource | None:
        """The RESOURCE that is to run, since a PLC is one of them; its global variables are declared, those of others are not."""
        if not self.project.configurations:
            return None
        configuration, source = self.project.configurations[0]
        names = [r.name.text for r in configuration.resources if r.name is not None]
        candidates = [r for r in configuration.resources
                      if wanted is None or r.name is not None and fold(r.name.text) == fold(wanted)]
        if wanted is not None and not candidates:
            self.report.add("S0801", source, configuration.name, f"there is no RESOURCE {wanted}",
                            self.project.choices(wanted, names))
        elif len(candidates) > 1 and program is None:
            self.report.add("S0801", source, candidates[1].name or candidates[1],
                            f"{configuration.name.text} has {len(candidates)} resources, and a PLC is one of them",
                            f"choose one with --resource {' or --resource '.join(names)}")
        if not candidates:
            return None
        self.project.sections += [(section, source) for section in candidates[0].sections]
        return candidates[0]

    def resolve(self, program: str | None) -> None:
        """Add the tasks to the context: those of the CONFIGURATION, or one task for the program that is named or the only one."""
        configurations = self.project.configurations
        if program is None and configurations:
            for extra, source in configurations[1:]:
                self.report.add("S0801", source, extra.name, "there is a second CONFIGURATION",
                                "a project has one", (configurations[0][1], configurations[0][0].name.start, "the first"))
            self._configuration(*configurations[0])
            return
        programs = [p for p in self.project.pous.values() if p.kind == "PROGRAM" and not p.source.library]
        if program is not None:
            programs = [p for p in programs if fold(p.name) == fold(program)]
        elif len(programs) > 1:
            called = {callee for body in self.context.bodies for callee in body.calls}
            programs = [p for p in programs if p not in called]
        if len(programs) == 1 and programs[0].type is not None:
            task = TaskFact("", LOWEST, 0)
            if self._instance(programs[0].name, programs[0], task, programs[0].source, programs[0].tree.name):
                self.context.tasks.append(task)
                self._unconnected(programs[0], task, programs[0].source, programs[0].tree.name, "")

    def begin_tasks(self) -> None:
        """Let each task call, in front of its programs, what libraries that tell programs about their tasks want called."""
        tasks = sorted(self.context.tasks, key=lambda task: task.priority)
        configurations = self.project.configurations
        application = configurations[0][0].name.text if configurations else "PLC"
        for library, function in self.project.libraries.tasks():
            for number, task in enumerate(tasks, 1):
                text = (f"PROGRAM Begins {function}(Index := {number}, CycleTime := {task.interval_ns // 100}, "
                        f"Priority := {min(task.priority, LOWEST - 1)}, "
                        f"Name := '{task.name}', Application := '{application}'); END_PROGRAM")
                source = Source(f"{library}/{function}", text, library)
                declared = parse(source)[0].declarations[0]
                assert isinstance(declared, tree.Pou)
                pou = Pou(f"{task.name or 'task'} begins", "PROGRAM", source, declared)
                self.context.check_body(pou)
                task.runs.insert(0, Run(task.runs[0].instance, pou))

    def _instance(self, name: str, pou: Pou, task: TaskFact, source: Source, node: tree.Node) -> bool:
        """Let the task run an instance of that name; False after a diagnostic."""
        assert pou.type is not None
        key = ("", fold(name))
        other = self.project.globals.get(key)
        if other is not None and other.type is pou.type and other not in self._run:
            task.runs.append(Run(other, pou))
            return True
        if other is not None:
            self.report.add("S0202", source, node, f"{name} is the name of a program and of a global variable", "",
                            (other.source, other.node.start, "the variable"))
            return False
        instance = Variable(name, pou.type, "PROGRAM", source, node, place="abs", initial=pou.initial)
        self.context.global_order.append(instance)
        self.project.globals[key] = instance
        self._run.append(instance)
        task.runs.append(Run(instance, pou))
        return True

    def _unconnected(self, pou: Pou, task: TaskFact, source: Source, node: tree.Name, connection: str) -> None:
        """Report an in-out of a program that nothing is connected to; in some dialects it gets a variable of its own."""
        in_outs = [variable for variable in pou.parameters("VAR_IN_OUT") if not variable.by_reference]
        name, role = next(((v.name, v.role_of_parameter) for v in pou.parameters("VAR_IN_OUT")), ("", ""))
        if in_outs and self.project.dialect.own_in_outs and name == in_outs[0].name:
            self._connect(node, node.end, tuple(self._own(variable, node, source) for variable in in_outs), task, source)
        elif name:
            self.report.add("S0404", source, node, f"the {role} {name} of {pou.name} is missing: a task runs the program",
                            (f"connect a variable: {connection.format(name)}" if connection else
                             "use a VAR_GLOBAL, or connect a variable in a CONFIGURATION") +
                            f", or take {takers('own_in_outs')}")

    def _own(self, in_out: Variable, node: tree.Name, source: Source) -> tree.Argument:
        """The connection of an in-out of a program with a hidden variable."""
        made = Variable(f"{node.text} {in_out.name}", in_out.type, "VAR_GLOBAL", source, node, place="abs",
                        initial=in_out.initial)
        self.context.global_order.append(made)
        self.project.globals["", fold(made.name)] = made
        self.report.add("S0193", in_out.source, in_out.node, f"nothing is connected to the in-out {in_out.name}: it is a "
                        "variable of the program")
        return tree.Argument(node.start, node.end, ":=", tree.Name(node.start, node.end, in_out.name),
                             tree.NameRef(node.start, node.end, made.name))

    def _configuration(self, configuration: tree.Configuration, source: Source) -> None:
        if self.context.resource is not None:
            self._resource(self.context.resource, source)

    def _resource(self, resource: tree.Resource, source: Source) -> None:
        tasks: dict[str, TaskFact] = {}
        for declared in resource.tasks:
            if fold(declared.name.text) in tasks:
                self.report.add("S0801", source, declared.name, f"the task {declared.name.text} is declared twice")
                continue
            tasks[fold(declared.name.text)] = self._task(declared, source)
        untasked = TaskFact("", LOWEST, 0)
        for program in resource.programs:
            task = self._named(program.task, tasks, source) if program.task is not None else untasked
            if self._program(program, task or untasked, source):
                self._blocks(program, (task or untasked).runs[-1].instance, tasks, source)
        self.context.tasks += [t for t in (*tasks.values(), untasked) if t.runs]

    def _named(self, name: tree.Name, tasks: dict[str, TaskFact], source: Source) -> TaskFact | None:
        """The task of that name, or None after a diagnostic."""
        task = tasks.get(fold(name.text))
        if task is None:
            self.report.add("S0801", source, name, f"there is no task {name.text}",
                            self.project.nearest(name.text, (t.name for t in tasks.values())))
        return task

    def _blocks(self, program: tree.ProgramInstance, instance: Variable, tasks: dict[str, TaskFact], source: Source) -> None:
        """Instances in a program that other tasks run: calls give them inputs and read outputs, and run nothing."""
        pou = self.project.pou(program.type_name.text, source)
        assert pou is not None
        for row in program.blocks:
            task = self._named(row.task, tasks, source)
            block = pou.variables.get(fold(row.instance.text)) if isinstance(row.instance, tree.NameRef) else None
            flag = pou.tasked.get(block) if block is not None else None
            if block is None or flag is None or not isinstance(block.type, StructType):
                self.report.add("S0801", source, row.instance,
                                f"a task runs an instance that {pou.name} declares in VAR; this is none",
                                "name the instance alone:  valve WITH slow")
                continue
            body = self.context.block_of(block.type)
            in_outs = body.parameters("VAR_IN_OUT")
            if in_outs:
                self.report.add("S0404", source, row.instance, f"the {in_outs[0].role_of_parameter} {in_outs[0].name} of "
                                f"{block.name} is missing: the task {row.task.text} runs it",
                                "let it have inputs and outputs only")
            elif task is not None:
                task.runs.append(Run(instance, body, block))
                instance.initial = instance.initial[:flag.offset] + b"\x01" + instance.initial[flag.offset + 1:]

    def _program(self, program: tree.ProgramInstance, task: TaskFact, source: Source) -> bool:
        """Make an instance of a program that the task runs; False if there is none."""
        pou = self.project.pou(program.type_name.text, source)
        if pou is None or pou.kind != "PROGRAM":
            names = [p.name for p in self.project.pous.values() if p.kind == "PROGRAM"]
            self.report.add("S0204", source, program.type_name, f"there is no PROGRAM {program.type_name.text}",
                            f"a task runs a PROGRAM, which calls an instance of the {pou.kind}" if pou is not None else
                            self.project.nearest(program.type_name.text, names))
        elif pou.type is not None and self._instance(program.name.text, pou, task, source, program.name):
            if program.connections:
                self._connect(program.name, program.end, program.connections, task, source)
            else:
                self._unconnected(pou, task, source, program.name, f"{program.type_name.text}({{}} := ...)")
            return True
        return False

    def _connect(self, name: tree.Name, end: int, connections: tuple[tree.Argument, ...], task: TaskFact,
                 source: Source) -> None:
        """Make a body for a program with connections: the task runs the body, which calls the instance with them."""
        call = tree.Call(name.start, end, tree.NameRef(name.start, name.end, name.text), connections)
        runner = tree.Pou(name.start, end, "PROGRAM", tree.Name(name.start, name.end, f"{name.text} run"), None, (),
                          (tree.CallStatement(name.start, end, call),))
        pou = Pou(runner.name.text, "PROGRAM", source, runner)
        self.context.check_body(pou)
        task.runs[-1] = Run(task.runs[-1].instance, pou)

    def _task(self, declared: tree.Task, source: Source) -> TaskFact:
        priority = self._constant(declared.priority, UINT, source) if declared.priority is not None else None
        if declared.priority is None:
            self.report.add("S0801", source, declared.name, f"the task {declared.name.text} has no PRIORITY",
                            "write PRIORITY := 0 for the highest")
        interval = self._constant(declared.interval, TIME, source) if declared.interval is not None else 0
        if interval is not None and interval < 0:
            assert declared.interval is not None
            self.report.add("S0801", source, declared.interval, "an INTERVAL is not negative")
        single = self._single(declared.single, source) if declared.single is not None else ""
        return TaskFact(declared.name.text, priority or 0, interval or 0, single)

    def _constant(self, expr: tree.Expr, kind: Type, source: Source) -> int | None:
        scope = Scope(self.context, source, None)
        if not scope.fit(expr, kind, "S0801"):
            return None
        value = scope.facts.constants.get(expr)
        if not isinstance(value, int):
            self.report.add("S0801", source, expr, "a task's data must be constant")
            return None
        return value

    def _single(self, expr: tree.Expr, source: Source) -> str:
        scope = Scope(self.context, source, None)
        kind = scope.infer(expr)
        if kind is not None and (not isinstance(expr, tree.NameRef) or base(kind) != BOOL):
            self.report.add("S0801", source, expr, "SINGLE needs a global BOOL variable")
            return ""
        return expr.text if isinstance(expr, tree.NameRef) and kind is not None else ""
