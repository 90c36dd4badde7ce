'use strict';
// Drives the client of the extension against a real server, with a stub in place of VS Code, and prints what VS Code would get.
// node vscode_stub.js FOLDER_OF_EXTENSION FOLDER_OF_PROGRAM COMMAND...

const Module = require('module');
const fs = require('fs');
const path = require('path');

const [extension, folder, ...command] = process.argv.slice(2);
class Position { constructor(line, character) { Object.assign(this, { line, character }); } }
class Range {
  constructor(...of) { [this.start, this.end] = of.length === 2 ? of : [new Position(of[0], of[1]), new Position(of[2], of[3])]; }
  toJSON() { return [this.start, this.end]; }
}
class Made { constructor(...given) { this.given = given; } }
class WorkspaceEdit { constructor() { this.files = {}; } set(uri, edits) { this.files[path.basename(uri.fsPath)] = edits.length; } }
const disposable = { dispose() {} };
const watcher = { onDidCreate: () => disposable, onDidChange: () => disposable, onDidDelete: () => disposable, dispose() {} };
const uri = (text) => ({ toString: () => text, fsPath: text.replace('file://', '') });
const providers = {};
const told = new Map();
let changed;
const known = {
  Position, Range, WorkspaceEdit,
  Uri: { parse: uri, file: (name) => uri(`file://${name}`) },
  CodeActionKind: { QuickFix: 'quickfix' },
  languages: new Proxy({ createDiagnosticCollection: () => ({ set: (of, found) => told.set(of.toString(), found), dispose() {} }) }, {
    get: (table, name) => table[name] || ((...given) => { providers[name] = given.find((each) => each && Object.values(each).some((value) => typeof value === 'function')); return disposable; }),
  }),
  workspace: {
    createFileSystemWatcher: () => watcher, onDidOpenTextDocument: () => disposable, onDidCloseTextDocument: () => disposable,
    onDidChangeTextDocument: (listener) => { changed = listener; return disposable; }, textDocuments: [],
  },
};
const vscode = new Proxy(known, { get: (table, name) => (name in table ? table[name] : Made) });
const load = Module._load;
Module._load = (name, ...rest) => (name === 'vscode' ? vscode : load(name, ...rest));

const { Client } = require(path.join(extension, 'client.js'));
const features = require(path.join(extension, 'features.js'));

async function main() {
  const file = path.join(folder, 'main.st');
  let text = fs.readFileSync(file, 'utf8');
  const document = { uri: known.Uri.file(file), languageId: 'iecst', version: 1, getText: () => text };
  known.workspace.textDocuments.push(document);
  const token = { onCancellationRequested() {} };
  const client = new Client(command, { folder, dialect: 'standard', libraries: [] }, null);
  const until = async (holds) => { while (!holds()) await new Promise((resolve) => setTimeout(resolve, 20)); };
  const found = () => told.get(document.uri.toString()) || [];
  const at = (word) => {
    const before = text.slice(0, text.indexOf(word)).split('\n');
    return new Position(before.length - 1, before[before.length - 1].length);
  };
  const print = (name, value) => console.log(`${name}: ${JSON.stringify(value)}`);

  const capabilities = await client.start();
  features.register(client, capabilities, []);
  client.synchronize(() => true);
  await until(() => found().length);
  const [wrong] = found();
  print('diagnostic', [wrong.code, wrong.given[1], wrong.given[0]]);
  Object.assign(wrong, { range: wrong.given[0], message: wrong.given[1], severity: wrong.given[2] });
  const fixes = await providers.registerCodeActionsProvider.provideCodeActions(document, wrong.range, { diagnostics: [wrong] }, token);
  print('fixes', fixes.map((each) => each.given[0]));
  const items = await providers.registerCompletionItemProvider.provideCompletionItems(document, wrong.range.start, token);
  print('completion', items.given[0].map((each) => each.given[0]));
  const start = at('Run;');
  document.version = 2;
  text = text.replace('Run;', 'Runs;');
  changed({ document, contentChanges: [{ range: new Range(start.line, start.character, start.line, start.character + 3), text: 'Runs' }] });
  await until(() => !found().length);
  print('mended', found());
  const edit = await providers.registerRenameProvider.provideRenameEdits(document, at('Pump;'), 'Motor', token);
  print('rename', edit.files);
  const help = await providers.registerSignatureHelpProvider.provideSignatureHelp(document, at('Level :='), token);
  print('signature', [help.signatures[0].given[0], help.activeParameter]);
  const symbols = await providers.registerDocumentSymbolProvider.provideDocumentSymbols(document, token);
  print('symbols', symbols.map((each) => [each.given[0], each.children.map((inner) => inner.given[0])]));
  const lenses = await providers.registerCodeLensProvider.provideCodeLenses(document, token);
  print('lenses', lenses.map((each) => each.given[1].title));
  await client.stop();
}

main().then(() => process.exit(0), (error) => { console.error(error); process.exit(1); });
