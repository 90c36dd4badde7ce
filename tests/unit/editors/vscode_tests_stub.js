'use strict';
// Drives the test view of the extension, with a stub in place of VS Code, and prints what VS Code would show.
// node vscode_tests_stub.js FOLDER_OF_EXTENSION FOLDER_OF_TESTS COMMAND...

const Module = require('module');
const fs = require('fs');
const path = require('path');

const [extension, folder, ...command] = process.argv.slice(2);
class Items extends Map { add(item) { this.set(item.id, item); } forEach(does) { [...this.values()].forEach((item) => does(item)); } }
class Range { constructor(line) { this.line = line; } }
class Position { constructor(line) { this.line = line; } }
class Made { constructor(...given) { this.given = given; } }
const disposable = { dispose() {} };
const profiles = {};
const shown = [];
const label = (item) => `${path.basename(item.uri.fsPath)} ${item.label}`;
const session = {
  started() {}, appendOutput() {}, end() {}, skipped: (item) => shown.push(`skipped ${label(item)}`),
  passed: (item) => shown.push(`passed ${label(item)}`),
  failed: (item, message) => shown.push(`failed ${label(item)} at line ${message.location ? message.location.given[1].line + 1 : '?'}`),
};
const controller = {
  items: new Items(), createTestItem: (id, name, uri) => ({ id, label: name, uri, children: new Items() }),
  createRunProfile: (name, kind, run) => { profiles[name] = run; }, createTestRun: () => session,
};
const uris = fs.readdirSync(folder).filter((name) => /^test_.*\.(st|py)$/.test(name)).sort().map((name) => {
  const fsPath = path.join(folder, name);
  return { fsPath, toString: () => `file://${fsPath}` };
});
const event = () => disposable;
const vscode = {
  Range, Position, Location: Made, TestMessage: class { constructor(text) { this.text = text; } }, TestRunProfileKind: { Run: 1, Coverage: 2, Debug: 3 },
  tests: { createTestController: () => controller }, extensions: { getExtension: () => undefined },
  workspace: {
    textDocuments: [], getWorkspaceFolder: () => ({ uri: { fsPath: folder } }), findFiles: async () => uris,
    fs: { readFile: async (uri) => fs.readFileSync(uri.fsPath) }, onDidChangeTextDocument: event, onDidOpenTextDocument: event,
    createFileSystemWatcher: () => ({ onDidCreate: event, onDidChange: event, onDidDelete: event, dispose() {} }),
  },
};
const load = Module._load;
Module._load = (name, ...rest) => (name === 'vscode' ? vscode : load(name, ...rest));
const tests = require(path.join(extension, 'tests.js'));

async function main() {
  tests.register(() => command, () => {});
  await controller.resolveHandler();
  controller.items.forEach((file) => file.children.forEach((item) => console.log(`${label(item)} line ${item.range.line + 1}`)));
  await profiles.Run({}, undefined);
  console.log(shown.sort().join('\n'));
}

main().then(() => process.exit(0), (error) => { console.error(error); process.exit(1); });
