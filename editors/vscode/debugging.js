'use strict';
// The debugger's side: buttons and menus for what the Debug Adapter Protocol has no request for, and values behind lines.

const vscode = require('vscode');

const session = () => {
  const active = vscode.debug.activeDebugSession;
  return active && active.type === 'fbvm' ? active : undefined;
};

async function ask(method, parameters) {
  const active = session();
  if (!active) return undefined;
  try {
    return await active.customRequest(method, parameters);
  } catch (error) {
    vscode.window.showWarningMessage(error.message);
    return undefined;
  }
}

const frameId = () => (vscode.debug.activeStackItem ? vscode.debug.activeStackItem.frameId : undefined);

// Menus of the view of variables hand over the row and its container; the palette hands over nothing.
async function nameOf(given, prompt) {
  const variable = given && given.variable;
  return variable ? variable.evaluateName || variable.name : vscode.window.showInputBox({ prompt });
}

async function show(text) {
  const document = await vscode.workspace.openTextDocument({ content: text });
  await vscode.window.showTextDocument(document, { preview: true, preserveFocus: true, viewColumn: vscode.ViewColumn.Beside });
}

const commands = {
  stepScan: () => ask('fbvm/stepScan', {}),
  stepBackScan: () => ask('fbvm/stepBackScan', {}),
  stepBackInto: () => ask('fbvm/stepBackInto', {}),
  goToScan: async () => {
    const scan = await vscode.window.showInputBox({ prompt: 'The number of a scan', validateInput: (text) => (/^\d+$/.test(text) ? null : 'a whole number from 0') });
    if (scan) await ask('fbvm/gotoScan', { scan: Number(scan) });
  },
  lastWrite: async (given) => {
    const name = await nameOf(given, 'The variable or address whose last change is wanted');
    if (name) await ask('fbvm/lastWrite', { name, frameId: frameId() });
  },
  why: async (given) => {
    const name = await nameOf(given, 'The variable whose value is to be explained');
    const answer = name && (await ask('fbvm/why', { name, frameId: frameId() }));
    if (answer) await show(answer.text);
  },
  force: async (given) => {
    const name = await nameOf(given, 'The variable or address that is forced');
    const value = name && (await vscode.window.showInputBox({ prompt: `The value that ${name} is forced to`, value: given?.variable?.value?.split(' ')[0] }));
    if (value) await ask('fbvm/force', { name, value });
  },
  unforce: async (given) => {
    const name = await nameOf(given, 'The variable that is released; nothing: all');
    if (name !== undefined) await ask('fbvm/unforce', name ? { name } : {});
  },
};

const inlineValues = {
  async provideInlineValues(document, viewport, context) {
    const answer = await ask('fbvm/inlineValues', {
      frameId: context.frameId, source: { path: document.uri.fsPath }, startLine: viewport.start.line + 1,
      endLine: Math.min(viewport.end.line, context.stoppedLocation.end.line) + 1,
    });
    return (answer ? answer.values : []).map((each) => new vscode.InlineValueText(
      new vscode.Range(each.line - 1, each.column - 1, each.line - 1, each.column - 1), each.text));
  },
};

function register(selector) {
  const made = Object.entries(commands).map(([name, action]) => vscode.commands.registerCommand(`fbvm.${name}`, action));
  return [...made, vscode.languages.registerInlineValuesProvider(selector, inlineValues)];
}

module.exports = { register, commands };
