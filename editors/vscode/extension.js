'use strict';
// The extension: starts the language server, gives VS Code the debugger, the tests, the tasks and the commands.

const { execFile, spawn } = require('child_process');
const fs = require('fs');
const path = require('path');
const vscode = require('vscode');
const { Client } = require('./client');
const debugging = require('./debugging');
const features = require('./features');
const tests = require('./tests');

const OLDEST = [0, 2];
const SELECTOR = [{ language: 'iecst' }, { language: 'st' }, { language: 'structured-text' }, { language: '61131-3-st' }, { language: 'twincat' },
  { pattern: '**/fbvm.toml' }, { pattern: '**/*.{plcproj,cxt,cxp}' }];
const FLAVOURS = new Set(SELECTOR.map((each) => each.language).filter(Boolean));

let client = null;
let provided = [];
let output = null;

const folder = () => vscode.workspace.workspaceFolders?.[0]?.uri.fsPath;
const settings = (uri) => vscode.workspace.getConfiguration('fbvm', uri);

// How fbvm is started for a folder: what is configured, else that of a virtual environment in the folder, else that of the PATH.
function commandOf(where) {
  const configured = settings().get('path');
  if (configured) return [configured];
  const names = process.platform === 'win32' ? ['Scripts', 'fbvm.exe'] : ['bin', 'fbvm'];
  for (const environment of ['.venv', 'venv']) {
    const own = where && path.join(where, environment, ...names);
    if (own && fs.existsSync(own)) return [own];
  }
  return ['fbvm'];
}

function version(command) {
  return new Promise((resolve, reject) => {
    execFile(command[0], [...command.slice(1), '--version'], (error, stdout) => (error ? reject(error) : resolve(stdout.trim())));
  });
}

async function usable(command) {
  try {
    const said = await version(command);
    const found = (/(\d+)\.(\d+)/.exec(said) || []).slice(1).map(Number);
    if (found.length && (found[0] < OLDEST[0] || (found[0] === OLDEST[0] && found[1] < OLDEST[1]))) {
      vscode.window.showErrorMessage(`${said} is too old for this extension: pip install -U "fbvm[editor]"`);
      return false;
    }
    return true;
  } catch {
    const answer = await vscode.window.showErrorMessage(
      `${command.join(' ')} is not there. Install it by pip install "fbvm[editor]", or say in fbvm.path where it is.`, 'Settings');
    if (answer) vscode.commands.executeCommand('workbench.action.openSettings', 'fbvm.path');
    return false;
  }
}

// --- the language server ---

async function startServer() {
  const command = commandOf(folder());
  if (!(await usable(command))) return;
  const log = settings().get('trace.server') === 'off' ? null : (line) => output.appendLine(line);
  const begun = new Client([...command, 'lsp'], { folder: folder(), dialect: settings().get('dialect'), libraries: settings().get('libraries') }, log);
  try {
    const capabilities = await begun.start();
    provided = features.register(begun, capabilities, SELECTOR);
    begun.synchronize((document) => document.uri.scheme === 'file'
      && vscode.languages.match(SELECTOR, document) > 0);
    begun.ended = (code) => vscode.window.showErrorMessage(`The server of fbvm ended with status ${code}.`, 'Restart')
      .then((answer) => answer && restart());
    client = begun;
  } catch (error) {
    vscode.window.showErrorMessage(`The server of fbvm does not start: ${error.message}. It needs pip install "fbvm[editor]".`);
  }
}

async function stopServer() {
  provided.forEach((each) => each.dispose());
  provided = [];
  const ending = client;
  client = null;
  if (ending) await ending.stop();
}

async function restart() {
  await stopServer();
  await startServer();
}

// --- running ---

// Lenses hand over a URI as text and the name of a PROGRAM; menus hand over a URI, the palette nothing.
function target(given) {
  if (typeof given === 'string') return vscode.Uri.parse(given);
  return given instanceof vscode.Uri ? given : vscode.window.activeTextEditor?.document.uri;
}

// The nearest file in the folder of a file or above whose name is accepted.
function fileAbove(uri, accepts) {
  for (let at = path.dirname(uri.fsPath); ; at = path.dirname(at)) {
    const found = fs.existsSync(at) && fs.readdirSync(at).find(accepts);
    if (found) return path.join(at, found);
    if (at === path.dirname(at)) return null;
  }
}

const projectOf = (uri) => fileAbove(uri, (name) => name === 'fbvm.toml');
const twincatProjectOf = (uri) => fileAbove(uri, (name) => name.toLowerCase().endsWith('.plcproj'));

function execute(uri, name, parts) {
  const where = vscode.workspace.getWorkspaceFolder(uri) || vscode.TaskScope.Workspace;
  const [command, ...first] = commandOf(folder());
  const task = new vscode.Task({ type: 'fbvm', verb: parts[0], files: parts.slice(1) }, where, name, 'fbvm',
    new vscode.ProcessExecution(command, [...first, ...parts]), '$fbvm');
  task.presentationOptions = { clear: true, showReuseMessage: false };
  return vscode.tasks.executeTask(task);
}

async function saved(given) {
  const uri = target(given);
  if (uri) await vscode.workspace.textDocuments.find((each) => each.uri.toString() === uri.toString())?.save();
  return uri;
}

const chosen = (program) => (typeof program === 'string' ? ['--program', program] : []);

async function runProgram(given, program) {
  const uri = await saved(given);
  if (uri) await execute(uri, 'run', ['run', projectOf(uri) || uri.fsPath, ...(projectOf(uri) ? [] : [...chosen(program), '--for', '10s'])]);
}

async function chart(given, program) {
  const uri = await saved(given);
  if (!uri) return;
  const page = path.join(fs.mkdtempSync(path.join(require('os').tmpdir(), 'fbvm-')), 'run.html');
  const running = await execute(uri, 'chart', ['run', uri.fsPath, ...chosen(program), '--for', '10s', '--html', page]);
  const ended = vscode.tasks.onDidEndTaskProcess((event) => {
    if (event.execution !== running) return;
    ended.dispose();
    if (!fs.existsSync(page)) return;
    const panel = vscode.window.createWebviewPanel('fbvm.chart', `Run of ${path.basename(uri.fsPath)}`, vscode.ViewColumn.Beside, { enableScripts: true });
    panel.webview.html = fs.readFileSync(page, 'utf8');
  });
}

// The page of the running PLC beside the code.  Its process ends with its panel.
async function live(given, program) {
  const uri = await saved(given);
  if (!uri) return;
  const [command, ...first] = commandOf(folder());
  const project = projectOf(uri);
  const inBrowser = vscode.env.uiKind === vscode.UIKind.Web;
  const frames = ['vscode-webview:', 'vscode-file:', ...(inBrowser ? ['http://127.0.0.1:*', 'http://localhost:*', 'https://*.vscode-cdn.net'] : [])];
  const running = spawn(command, [...first, 'live', project || uri.fsPath, ...(project ? [] : chosen(program)), ...frames.flatMap((each) => ['--frame', each])],
    { cwd: path.dirname(project || uri.fsPath) });
  const panel = vscode.window.createWebviewPanel('fbvm.live', `${path.basename(project ? path.dirname(project) : uri.fsPath)} live`, vscode.ViewColumn.Beside,
    { enableScripts: true, retainContextWhenHidden: true });
  let told = '';
  let said = '';
  panel.onDidDispose(() => running.kill());
  running.stderr.on('data', (data) => { told += data; output.append(String(data)); });
  running.stdout.on('data', async (data) => {
    const isNew = !/^http:\S+\n/m.test(said);
    said += data;
    const found = /^(http:\/\/127\.0\.0\.1:\d+)(\/#token=[\w-]+)\r?\n/m.exec(said);
    if (!isNew || !found) return;
    // A remote VS Code forwards the port; a proxy with a path of its own is of no use, since the page asks for / on its own port.
    const forwarded = String(await vscode.env.asExternalUri(vscode.Uri.parse(found[1]))).replace(/\/$/, '');
    const outside = /^http:\/\/(127\.0\.0\.1|localhost):\d+$/.test(forwarded) ? forwarded : found[1];
    panel.webview.html = `<!doctype html><meta http-equiv="Content-Security-Policy" content="default-src 'none'; frame-src ${outside}; style-src 'unsafe-inline'">
<style>html, body, iframe { margin: 0; padding: 0; border: 0; width: 100%; height: 100vh; display: block }</style>
<iframe title="The PLC" sandbox="allow-scripts allow-same-origin allow-forms allow-downloads" src="${outside}${found[2]}"></iframe>`;
  });
  running.on('error', (error) => vscode.window.showErrorMessage(`${command} does not start: ${error.message}`));
  running.on('exit', (code) => {
    if (code && !said) vscode.window.showErrorMessage(`fbvm live ended with status ${code}: ${told.trim().split('\n')[0]}`);
    panel.dispose();
  });
}

function debug(given, more) {
  const uri = target(given);
  const configuration = { type: 'fbvm', request: 'launch', name: uri ? path.basename(uri.fsPath) : 'fbvm', ...(uri ? { program: uri.fsPath } : {}), ...more };
  return vscode.debug.startDebugging(uri && vscode.workspace.getWorkspaceFolder(uri), configuration);
}

async function explain() {
  const line = vscode.window.activeTextEditor;
  const word = line && line.document.getText(line.document.getWordRangeAtPosition(line.selection.active));
  const asked = await vscode.window.showInputBox({ prompt: 'A code such as S0301, an instruction such as MOV, a block such as TON', value: word });
  if (!asked) return;
  const [command, ...first] = commandOf(folder());
  execFile(command, [...first, 'explain', asked], async (error, stdout, stderr) => {
    const document = await vscode.workspace.openTextDocument({ language: 'markdown', content: error ? stderr : stdout });
    await vscode.window.showTextDocument(document, { preview: true, viewColumn: vscode.ViewColumn.Beside });
  });
}

async function importProject(uri) {
  if (!uri) return;
  const where = path.join(path.dirname(uri.fsPath), path.basename(uri.fsPath, '.xml'));
  await execute(uri, 'import', ['import', uri.fsPath, '-o', where]);
}

// --- VS Code's side ---

const adapter = {
  createDebugAdapterDescriptor({ configuration }) {
    const [command, ...first] = commandOf(folder());
    const where = configuration.request === 'attach' ? ['--connect', String(configuration.connect)] : [];
    return new vscode.DebugAdapterExecutable(command, [...first, 'dap', ...where]);
  },
};

const configurations = {
  // F5 without a launch.json: the project if there is one, else the file.
  resolveDebugConfiguration(where, configuration) {
    if (configuration.type) return { cwd: where?.uri.fsPath, ...configuration };
    const document = vscode.window.activeTextEditor?.document;
    if (!document || !FLAVOURS.has(document.languageId)) return undefined;
    const project = projectOf(document.uri);
    const program = (document.languageId === 'twincat' && twincatProjectOf(document.uri)) || document.uri.fsPath;
    return { type: 'fbvm', request: 'launch', name: path.basename(document.uri.fsPath), cwd: where?.uri.fsPath,
      ...(project ? { project } : { program }) };
  },
  provideDebugConfigurations() {
    return [{ type: 'fbvm', request: 'launch', name: 'Debug this program', program: '${file}' }];
  },
};

const taskProvider = {
  provideTasks() {
    const [command, ...first] = commandOf(folder());
    const made = (verb, files, name) => new vscode.Task({ type: 'fbvm', verb, files }, vscode.TaskScope.Workspace, name, 'fbvm',
      new vscode.ProcessExecution(command, [...first, verb, ...files]), '$fbvm');
    const current = vscode.window.activeTextEditor?.document;
    const open = current && FLAVOURS.has(current.languageId) ? [made('check', [current.uri.fsPath], 'check this file')] : [];
    return [...open, made('test', [], 'test')];
  },
  resolveTask(task) {
    const [command, ...first] = commandOf(folder());
    const { verb, files = [] } = task.definition;
    return new vscode.Task(task.definition, task.scope, task.name, 'fbvm', new vscode.ProcessExecution(command, [...first, verb, ...files]), '$fbvm');
  },
};

async function activate(context) {
  output = vscode.window.createOutputChannel('fbvm');
  const view = tests.register(() => commandOf(folder()), (uri, test) => debug(uri, { program: undefined, test }));
  const runner = view[view.length - 1];
  const on = (name, action) => vscode.commands.registerCommand(`fbvm.${name}`, action);
  context.subscriptions.push(
    output, ...view, ...debugging.register(SELECTOR.filter((each) => each.language)),
    on('run', runProgram), on('chart', chart), on('live', live), on('explain', explain), on('import', importProject), on('restart', restart),
    on('debug', (given, program) => debug(given, typeof program === 'string' ? { main: program } : {})),
    on('check', async () => { const uri = await saved(); if (uri) await execute(uri, 'check', ['check', uri.fsPath]); }),
    on('test', (uri, name) => runner.runTest(uri, name)),
    on('debugTest', (uri, name) => debug(uri, { program: undefined, test: `${vscode.Uri.parse(uri).fsPath}::${name}` })),
    vscode.debug.registerDebugAdapterDescriptorFactory('fbvm', adapter),
    vscode.debug.registerDebugConfigurationProvider('fbvm', configurations),
    vscode.debug.registerDebugConfigurationProvider('fbvm', configurations, vscode.DebugConfigurationProviderTriggerKind.Dynamic),
    vscode.tasks.registerTaskProvider('fbvm', taskProvider),
    vscode.workspace.onDidChangeConfiguration((event) => event.affectsConfiguration('fbvm') && restart()),
  );
  await startServer();
}

module.exports = { activate, deactivate: stopServer };
