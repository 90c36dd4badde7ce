'use strict';
// A client of the Language Server Protocol over the standard streams of a process: messages, and texts kept equal.

const { spawn } = require('child_process');
const vscode = require('vscode');
const { plain } = require('./features');

const CAPABILITIES = {
  general: { positionEncodings: ['utf-16'] },
  workspace: { workspaceEdit: { documentChanges: false }, didChangeWatchedFiles: { dynamicRegistration: false }, symbol: {} },
  textDocument: {
    synchronization: { didSave: false },
    publishDiagnostics: { relatedInformation: true, tagSupport: { valueSet: [1, 2] } },
    completion: { completionItem: { snippetSupport: true, documentationFormat: ['markdown'] } },
    hover: { contentFormat: ['markdown'] },
    signatureHelp: { signatureInformation: { activeParameterSupport: true } },
    documentSymbol: { hierarchicalDocumentSymbolSupport: true },
    rename: { prepareSupport: true },
    codeAction: { codeActionLiteralSupport: { codeActionKind: { valueSet: ['quickfix'] } }, isPreferredSupport: true },
    semanticTokens: { requests: { full: true }, tokenTypes: [], tokenModifiers: [], formats: ['relative'] },
  },
};

class Client {
  // command: an array, program first; log: called with a line for each message, or null.
  constructor(command, settings, log) {
    this.command = command;
    this.settings = settings;
    this.log = log;
    this.waiting = new Map();
    this.listeners = new Map();
    this.number = 0;
    this.buffer = Buffer.alloc(0);
    this.opened = new Set();
    this.subscriptions = [];
    this.ended = null;
  }

  async start() {
    this.process = spawn(this.command[0], this.command.slice(1), { cwd: this.settings.folder });
    this.process.stdout.on('data', (data) => this.receive(data));
    this.process.stderr.on('data', (data) => this.log && this.log(`! ${data}`));
    const ended = new Promise((resolve, reject) => {
      this.process.on('error', reject);
      this.process.on('exit', (code) => {
        for (const { reject: refuse } of this.waiting.values()) refuse(new Error('the server has ended'));
        this.waiting.clear();
        if (this.ended) this.ended(code);
        reject(new Error(`${this.command.join(' ')} ended with status ${code}`));
      });
    });
    ended.catch(() => {});
    const begun = this.request('initialize', {
      processId: process.pid,
      rootUri: this.settings.folder ? vscode.Uri.file(this.settings.folder).toString() : null,
      capabilities: CAPABILITIES,
      initializationOptions: { dialect: this.settings.dialect, libraries: this.settings.libraries },
    });
    const answer = await Promise.race([begun, ended]);
    this.notify('initialized', {});
    return answer.capabilities;
  }

  async stop() {
    for (const each of this.subscriptions) each.dispose();
    this.ended = null;
    if (!this.process || this.process.exitCode !== null) return;
    try {
      await Promise.race([this.request('shutdown', null), new Promise((resolve) => setTimeout(resolve, 2000))]);
      this.notify('exit', null);
    } catch {
      this.process.kill();
    }
  }

  // --- messages ---

  send(message) {
    const body = Buffer.from(JSON.stringify({ jsonrpc: '2.0', ...message }), 'utf8');
    if (this.log) this.log(`> ${body}`);
    if (this.process.stdin.writable) {
      this.process.stdin.write(`Content-Length: ${body.length}\r\n\r\n`);
      this.process.stdin.write(body);
    }
  }

  notify(method, params) {
    this.send({ method, params });
  }

  request(method, params, token) {
    const id = ++this.number;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      if (token) token.onCancellationRequested(() => this.notify('$/cancelRequest', { id }));
      this.send({ id, method, params });
    });
  }

  on(method, listener) {
    this.listeners.set(method, listener);
  }

  receive(data) {
    this.buffer = Buffer.concat([this.buffer, data]);
    for (;;) {
      const end = this.buffer.indexOf('\r\n\r\n');
      if (end < 0) return;
      const length = /content-length: *(\d+)/i.exec(this.buffer.toString('ascii', 0, end));
      const begin = end + 4;
      const size = length ? Number(length[1]) : 0;
      if (this.buffer.length < begin + size) return;
      const text = this.buffer.toString('utf8', begin, begin + size);
      this.buffer = this.buffer.subarray(begin + size);
      if (this.log) this.log(`< ${text}`);
      this.message(JSON.parse(text));
    }
  }

  message(message) {
    if (message.method === undefined) {
      const asked = this.waiting.get(message.id);
      this.waiting.delete(message.id);
      if (!asked) return;
      if (message.error) asked.reject(Object.assign(new Error(message.error.message), { code: message.error.code }));
      else asked.resolve(message.result);
      return;
    }
    const listener = this.listeners.get(message.method);
    if (listener) listener(message.params);
    if (message.id !== undefined) this.send({ id: message.id, result: null });
  }

  // --- texts ---

  // Keep the server's texts equal to those that `belongs` accepts, and tell it which files change on disk.
  synchronize(belongs) {
    const open = (document) => {
      if (!belongs(document) || this.opened.has(document.uri.toString())) return;
      this.opened.add(document.uri.toString());
      this.notify('textDocument/didOpen', {
        textDocument: { uri: document.uri.toString(), languageId: document.languageId, version: document.version, text: document.getText() },
      });
    };
    const close = (document) => {
      if (this.opened.delete(document.uri.toString())) {
        this.notify('textDocument/didClose', { textDocument: { uri: document.uri.toString() } });
      }
    };
    const changed = (event) => {
      if (!this.opened.has(event.document.uri.toString()) || !event.contentChanges.length) return;
      this.notify('textDocument/didChange', {
        textDocument: { uri: event.document.uri.toString(), version: event.document.version },
        contentChanges: event.contentChanges.map((change) => ({ range: plain(change.range), text: change.text })),
      });
    };
    const watcher = vscode.workspace.createFileSystemWatcher('**/{*.st,fbvm.toml,*.{TcPOU,TcDUT,TcGVL,TcIO,TcTTO,plcproj,cxt,cxp}}');
    const told = (type) => (uri) => this.notify('workspace/didChangeWatchedFiles', { changes: [{ uri: uri.toString(), type }] });
    this.subscriptions.push(
      vscode.workspace.onDidOpenTextDocument(open),
      vscode.workspace.onDidCloseTextDocument(close),
      vscode.workspace.onDidChangeTextDocument(changed),
      watcher, watcher.onDidCreate(told(1)), watcher.onDidChange(told(2)), watcher.onDidDelete(told(3)),
    );
    vscode.workspace.textDocuments.forEach(open);
  }
}

module.exports = { Client };
