'use strict';
// What the server knows, in the forms of VS Code: each provider asks one request and turns the answer round.

const vscode = require('vscode');

const position = (at) => new vscode.Position(at.line, at.character);
const plain = (of) => ({ start: { line: of.start.line, character: of.start.character }, end: { line: of.end.line, character: of.end.character } });
const range = (of) => new vscode.Range(position(of.start), position(of.end));
const location = (of) => new vscode.Location(vscode.Uri.parse(of.uri), range(of.range));
const edit = (of) => new vscode.TextEdit(range(of.range), of.newText);
const markdown = (text) => {
  const shown = new vscode.MarkdownString(typeof text === 'string' ? text : text.value);
  shown.supportHtml = false;
  return shown;
};
const at = (document, place) => ({ textDocument: { uri: document.uri.toString() }, position: place });
const whole = (document) => ({ textDocument: { uri: document.uri.toString() } });

function diagnostic(of) {
  const made = new vscode.Diagnostic(range(of.range), of.message, of.severity - 1);
  made.code = of.code;
  made.source = of.source;
  made.tags = of.tags || [];
  made.relatedInformation = (of.relatedInformation || []).map(
    (each) => new vscode.DiagnosticRelatedInformation(location(each.location), each.message));
  return made;
}

function sent(of) {
  return { range: plain(of.range), message: of.message, severity: of.severity + 1, code: of.code, source: of.source };
}

function symbol(of) {
  const made = new vscode.DocumentSymbol(of.name, of.detail || '', of.kind - 1, range(of.range), range(of.selectionRange));
  made.children = (of.children || []).map(symbol);
  return made;
}

function workspaceEdit(of) {
  const made = new vscode.WorkspaceEdit();
  for (const [uri, edits] of Object.entries(of.changes || {})) made.set(vscode.Uri.parse(uri), edits.map(edit));
  return made;
}

function completionItem(of) {
  const made = new vscode.CompletionItem(of.label, of.kind === undefined ? undefined : of.kind - 1);
  made.detail = of.detail;
  made.sortText = of.sortText;
  made.filterText = of.filterText;
  if (of.documentation) made.documentation = markdown(of.documentation);
  if (of.textEdit) {
    made.range = range(of.textEdit.range);
    made.insertText = of.textEdit.newText;
  } else if (of.insertText) {
    made.insertText = of.insertTextFormat === 2 ? new vscode.SnippetString(of.insertText) : of.insertText;
  }
  made.answer = of;
  return made;
}

function callItem(of) {
  const made = new vscode.CallHierarchyItem(of.kind - 1, of.name, of.detail || '', vscode.Uri.parse(of.uri), range(of.range), range(of.selectionRange));
  made.answer = of;
  return made;
}

// Register all providers; returns what is to be disposed of.
function register(client, capabilities, selector) {
  const ask = async (method, params, token, turn) => {
    const answer = await client.request(method, params, token);
    return answer === null || answer === undefined ? undefined : turn(answer);
  };
  const found = vscode.languages.createDiagnosticCollection('fbvm');
  client.on('textDocument/publishDiagnostics', (params) => found.set(vscode.Uri.parse(params.uri), params.diagnostics.map(diagnostic)));

  const languages = vscode.languages;
  const legend = capabilities.semanticTokensProvider.legend;
  const triggers = capabilities.completionProvider.triggerCharacters;
  const all = [
    found,
    languages.registerCompletionItemProvider(selector, {
      provideCompletionItems: (document, place, token) => ask('textDocument/completion', at(document, place), token,
        (answer) => new vscode.CompletionList(answer.items.map(completionItem), answer.isIncomplete)),
      resolveCompletionItem: async (item, token) => {
        if (!item.answer.data) return item;
        const answer = await client.request('completionItem/resolve', item.answer, token);
        if (answer && answer.documentation) item.documentation = markdown(answer.documentation);
        return item;
      },
    }, ...triggers),
    languages.registerHoverProvider(selector, {
      provideHover: (document, place, token) => ask('textDocument/hover', at(document, place), token,
        (answer) => new vscode.Hover(markdown(answer.contents), answer.range && range(answer.range))),
    }),
    languages.registerSignatureHelpProvider(selector, {
      provideSignatureHelp: (document, place, token) => ask('textDocument/signatureHelp', at(document, place), token, (answer) => {
        const made = new vscode.SignatureHelp();
        made.signatures = answer.signatures.map((each) => {
          const shown = new vscode.SignatureInformation(each.label, each.documentation);
          shown.parameters = each.parameters.map((parameter) => new vscode.ParameterInformation(parameter.label));
          return shown;
        });
        made.activeSignature = 0;
        made.activeParameter = answer.activeParameter === undefined || answer.activeParameter === null ? -1 : answer.activeParameter;
        return made;
      }),
    }, '(', ','),
    languages.registerDefinitionProvider(selector, {
      provideDefinition: (document, place, token) => ask('textDocument/definition', at(document, place), token, location),
    }),
    languages.registerTypeDefinitionProvider(selector, {
      provideTypeDefinition: (document, place, token) => ask('textDocument/typeDefinition', at(document, place), token, location),
    }),
    languages.registerReferenceProvider(selector, {
      provideReferences: (document, place, context, token) => ask('textDocument/references',
        { ...at(document, place), context }, token, (answer) => answer.map(location)),
    }),
    languages.registerDocumentHighlightProvider(selector, {
      provideDocumentHighlights: (document, place, token) => ask('textDocument/documentHighlight', at(document, place), token,
        (answer) => answer.map((each) => new vscode.DocumentHighlight(range(each.range), each.kind - 1))),
    }),
    languages.registerDocumentSymbolProvider(selector, {
      provideDocumentSymbols: (document, token) => ask('textDocument/documentSymbol', whole(document), token, (answer) => answer.map(symbol)),
    }),
    languages.registerWorkspaceSymbolProvider({
      provideWorkspaceSymbols: (query, token) => ask('workspace/symbol', { query }, token, (answer) => answer.map(
        (each) => new vscode.SymbolInformation(each.name, each.kind - 1, each.containerName || '', location(each.location)))),
    }),
    languages.registerRenameProvider(selector, {
      prepareRename: async (document, place, token) => {
        const answer = await client.request('textDocument/prepareRename', at(document, place), token);
        if (!answer) throw new Error('This cannot be renamed.');
        return range(answer);
      },
      provideRenameEdits: (document, place, newName, token) => ask('textDocument/rename', { ...at(document, place), newName }, token, workspaceEdit),
    }),
    languages.registerDocumentFormattingEditProvider(selector, {
      provideDocumentFormattingEdits: (document, options, token) => ask('textDocument/formatting', { ...whole(document), options }, token,
        (answer) => answer.map(edit)),
    }),
    languages.registerDocumentRangeFormattingEditProvider(selector, {
      provideDocumentRangeFormattingEdits: (document, of, options, token) => ask('textDocument/rangeFormatting',
        { ...whole(document), range: plain(of), options }, token, (answer) => answer.map(edit)),
    }),
    languages.registerCodeActionsProvider(selector, {
      provideCodeActions: (document, of, context, token) => ask('textDocument/codeAction',
        { ...whole(document), range: plain(of), context: { diagnostics: context.diagnostics.map(sent) } }, token,
        (answer) => answer.map((each) => {
          const made = new vscode.CodeAction(each.title, vscode.CodeActionKind.QuickFix);
          made.diagnostics = (each.diagnostics || []).map(diagnostic);
          made.edit = workspaceEdit(each.edit);
          made.isPreferred = each.isPreferred || false;
          return made;
        })),
    }, { providedCodeActionKinds: [vscode.CodeActionKind.QuickFix] }),
    languages.registerCodeLensProvider(selector, {
      provideCodeLenses: (document, token) => ask('textDocument/codeLens', whole(document), token,
        (answer) => answer.map((each) => new vscode.CodeLens(range(each.range), each.command))),
    }),
    languages.registerInlayHintsProvider(selector, {
      provideInlayHints: (document, of, token) => ask('textDocument/inlayHint', { ...whole(document), range: plain(of) }, token,
        (answer) => answer.map((each) => {
          const made = new vscode.InlayHint(position(each.position), each.label);
          made.paddingLeft = each.paddingLeft;
          return made;
        })),
    }),
    languages.registerFoldingRangeProvider(selector, {
      provideFoldingRanges: (document, context, token) => ask('textDocument/foldingRange', whole(document), token, (answer) => answer.map(
        (each) => new vscode.FoldingRange(each.startLine, each.endLine, { comment: 1, region: 3 }[each.kind]))),
    }),
    languages.registerDocumentSemanticTokensProvider(selector, {
      provideDocumentSemanticTokens: (document, token) => ask('textDocument/semanticTokens/full', whole(document), token,
        (answer) => new vscode.SemanticTokens(new Uint32Array(answer.data))),
    }, new vscode.SemanticTokensLegend(legend.tokenTypes, legend.tokenModifiers)),
    languages.registerCallHierarchyProvider(selector, {
      prepareCallHierarchy: (document, place, token) => ask('textDocument/prepareCallHierarchy', at(document, place), token,
        (answer) => answer.map(callItem)),
      provideCallHierarchyIncomingCalls: (item, token) => ask('callHierarchy/incomingCalls', { item: item.answer }, token,
        (answer) => answer.map((each) => new vscode.CallHierarchyIncomingCall(callItem(each.from), each.fromRanges.map(range)))),
      provideCallHierarchyOutgoingCalls: (item, token) => ask('callHierarchy/outgoingCalls', { item: item.answer }, token,
        (answer) => answer.map((each) => new vscode.CallHierarchyOutgoingCall(callItem(each.to), each.fromRanges.map(range)))),
    }),
  ];
  return all;
}

module.exports = { register, plain };
