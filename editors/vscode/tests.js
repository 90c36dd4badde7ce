'use strict';
// The test view: each PROGRAM of a test_*.st, and the tests of those test_*.py that use fbvm, by their names in pytest.
// Where the Python extension shows the tests of pytest, those of test_*.py are left to it.

const { spawn } = require('child_process');
const path = require('path');
const vscode = require('vscode');

const FILES = '**/test_*.{st,py}';
const IS_TEST = /^test_.*\.(st|py)$/;
const PROGRAM = /^[ \t]*PROGRAM[ \t]+([A-Za-z_]\w*)/gim;
const PYTHON = /^(?:class[ \t]+(Test\w*)|([ \t]*)(?:async[ \t]+)?def[ \t]+(test\w*)[ \t]*\()/gm;
// The package, or one of the fixtures that it gives to tests.
const USES_FBVM = /^\s*(?:from|import)\s+fbvm\b|\bdef\s+\w+\([^)]*\b(?:fb|plc|plant|network|trace)\b/m;
const RESULT = /^(\S.*?\.(?:st|py))::(\S+?)(\[.*\])? (PASSED|FAILED|ERROR|SKIPPED)/;

// The tests in a text: their names behind the file, as pytest writes them, and their places.
function testsOf(name, text) {
  const rows = [];
  const lineAt = (index) => text.slice(0, index).split('\n').length - 1;
  if (name.endsWith('.st')) {
    for (const found of text.matchAll(PROGRAM)) rows.push({ node: found[1], label: found[1], line: lineAt(found.index), length: found[0].length });
    return rows;
  }
  if (!USES_FBVM.test(text)) return rows;
  let inside = '';
  for (const found of text.matchAll(PYTHON)) {
    if (found[1]) inside = found[1];
    else {
      if (!found[2]) inside = '';
      const node = inside ? `${inside}::${found[3]}` : found[3];
      rows.push({ node, label: node.replace('::', '.'), line: lineAt(found.index), length: found[0].length });
    }
  }
  return rows;
}

// Whether the Python extension shows the tests of pytest.
function isPythonShown() {
  return Boolean(vscode.extensions.getExtension('ms-python.python'))
    && vscode.workspace.getConfiguration('python.testing').get('pytestEnabled') === true;
}

// Run a command; `line` is called with each line of its output.  Resolves with its exit status.
function run(command, folder, line, token) {
  return new Promise((resolve) => {
    const child = spawn(command[0], command.slice(1), { cwd: folder });
    let rest = '';
    const take = (data) => {
      const lines = (rest + data).split(/\r?\n/);
      rest = lines.pop();
      lines.forEach(line);
    };
    child.stdout.on('data', take);
    child.stderr.on('data', take);
    child.on('error', (error) => { line(String(error.message)); resolve(2); });
    child.on('close', (code) => { if (rest) line(rest); resolve(code); });
    if (token) token.onCancellationRequested(() => child.kill('SIGINT'));
  });
}

// Register the view.  commandOf(folder) is how fbvm is started there; debug(item) begins a session for a test.
function register(commandOf, debug) {
  const controller = vscode.tests.createTestController('fbvm', 'fbvm');

  const folderOf = (uri) => vscode.workspace.getWorkspaceFolder(uri)?.uri.fsPath || path.dirname(uri.fsPath);
  const nodeOf = (item) => `${item.uri.fsPath}${item.id.slice(item.uri.toString().length)}`;

  function discover(uri, text) {
    const file = controller.createTestItem(uri.toString(), path.basename(uri.fsPath), uri);
    const isLeft = uri.fsPath.endsWith('.py') && isPythonShown();
    for (const { node, label, line, length } of isLeft ? [] : testsOf(uri.fsPath, text)) {
      const item = controller.createTestItem(`${uri}::${node}`, label, uri);
      item.range = new vscode.Range(line, 0, line, length);
      file.children.add(item);
    }
    if (file.children.size) controller.items.add(file);
    else controller.items.delete(uri.toString());
  }

  async function read(uri) {
    discover(uri, Buffer.from(await vscode.workspace.fs.readFile(uri)).toString('utf8'));
  }

  // An open file has its marks before anybody opens the view of tests.
  function shown(document) {
    if (IS_TEST.test(path.basename(document.uri.fsPath))) discover(document.uri, document.getText());
  }
  vscode.workspace.textDocuments.forEach(shown);

  controller.resolveHandler = async (item) => {
    if (item) return;
    for (const uri of await vscode.workspace.findFiles(FILES, '**/{.venv,node_modules}/**')) await read(uri);
  };

  async function runAll(request, token, coverage) {
    const session = controller.createTestRun(request);
    const items = [];
    const add = (item) => (item.children.size ? item.children.forEach(add) : items.push(item));
    (request.include || [...controller.items].map(([, item]) => item)).forEach(add);
    const wanted = items.filter((item) => !(request.exclude || []).includes(item));
    for (const folder of new Set(wanted.map((item) => folderOf(item.uri)))) {
      const here = wanted.filter((item) => folderOf(item.uri) === folder);
      const left = new Set(here);
      const wrong = new Set();
      const rows = new Set();
      here.forEach((item) => session.started(item));
      const messages = new Map();
      let failing = null;
      const line = (text) => {
        session.appendOutput(`${text}\r\n`);
        const head = /^_+ (.+?) _+$/.exec(text);
        if (head) failing = here.find((item) => item.label === head[1].split('::').pop().replace(/\[.*\]$/, '')) || null;
        else if (failing) messages.set(failing, `${messages.get(failing) || ''}${text}\n`);
        const result = RESULT.exec(text);
        const item = result && here.find((each) => path.resolve(folder, result[1]) === each.uri.fsPath && nodeOf(each).endsWith(`::${result[2]}`));
        if (!item) return;
        if (result[4] === 'FAILED' || result[4] === 'ERROR') wrong.add(item);
        else if (result[3]) rows.add(item);  // one of several, of which another may be wrong
        else { session[result[4] === 'PASSED' ? 'passed' : 'skipped'](item); left.delete(item); }
      };
      const command = [...commandOf(folder), 'test', '-v', '--color=no', ...(coverage ? ['--fbvm-cov'] : []), ...here.map(nodeOf)];
      await run(command, folder, line, token);
      for (const item of rows) if (!wrong.has(item)) { session.passed(item); left.delete(item); }
      for (const item of left) {
        const message = new vscode.TestMessage(messages.get(item) || 'The test was not run; its output says why.');
        const place = /(\d+): in \w+, scan|\.py:(\d+): \w+$/m.exec(messages.get(item) || '');
        if (place) message.location = new vscode.Location(item.uri, new vscode.Position(Number(place[1] || place[2]) - 1, 0));
        session.failed(item, message);
      }
    }
    session.end();
  }

  controller.createRunProfile('Run', vscode.TestRunProfileKind.Run, (request, token) => runAll(request, token, false), true);
  controller.createRunProfile('Run with coverage', vscode.TestRunProfileKind.Coverage, (request, token) => runAll(request, token, true));
  controller.createRunProfile('Debug', vscode.TestRunProfileKind.Debug, async (request) => {
    for (const item of request.include || []) await debug(item.uri, nodeOf(item));
  });

  const watcher = vscode.workspace.createFileSystemWatcher(FILES);
  return [
    controller, watcher,
    watcher.onDidCreate(read), watcher.onDidChange(read), watcher.onDidDelete((uri) => controller.items.delete(uri.toString())),
    vscode.workspace.onDidChangeTextDocument(({ document }) => shown(document)),
    vscode.workspace.onDidOpenTextDocument(shown),
    { runTest: (uri, name) => {
      const file = controller.items.get(uri);
      const item = file && file.children.get(`${uri}::${name}`);
      return item ? runAll(new vscode.TestRunRequest([item]), undefined, false) : undefined;
    }, dispose: () => {} },
  ];
}

module.exports = { register, testsOf };
