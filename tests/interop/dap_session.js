// What the DebugClient of @vscode/debugadapter-testsupport says to `fbvm dap`: node dap_session.js PORT FILE.  Prints what it got as JSON.
// Status 77 if the package is not installed.
let DebugClient;
try { ({ DebugClient } = require("@vscode/debugadapter-testsupport")); } catch (error) { process.exit(77); }
const [port, file] = process.argv.slice(2);
const client = new DebugClient("", "", "fbvm");
const thread = { threadId: 1 };
const moved = async (request) => (await Promise.all([client.waitForEvent("stopped"), request]))[0].body;
const value = async (expression) => (await client.evaluateRequest({ expression, context: "watch" })).body.result;

async function session() {
    const found = {};
    await client.start(Number(port));
    await client.hitBreakpoint({ program: file }, { path: file, line: 4 });
    found.first = await value("Main.n");
    await client.setBreakpointsRequest({ source: { path: file }, breakpoints: [{ line: 4, condition: "n = 400" }] });
    await moved(client.continueRequest(thread));
    found.later = await value("Main.n");
    const info = (await client.send("dataBreakpointInfo", { name: "D200" })).body;
    found.data = [info.dataId, info.accessTypes];
    found.back = (await moved(client.stepBackRequest(thread))).description;
    found.before = await value("Main.n");
    const { stackFrames } = (await client.stackTraceRequest(thread)).body;
    found.frame = [stackFrames[0].name, stackFrames[0].line];
    const { scopes } = (await client.scopesRequest({ frameId: stackFrames[0].id })).body;
    const locals = scopes.find((scope) => scope.name === "Locals");
    found.locals = (await client.variablesRequest({ variablesReference: locals.variablesReference })).body.variables.map((row) => row.name);
    await client.setBreakpointsRequest({ source: { path: file }, breakpoints: [] });
    await client.continueRequest(thread);
    found.pause = (await moved(client.pauseRequest(thread))).reason;
    found.end = (await moved(client.reverseContinueRequest(thread))).reason;
    found.refused = await client.customRequest("nonsense").then(() => "", (error) => error.message);
    await client.stop();
    console.log(JSON.stringify(found));
}
session().then(() => process.exit(0), (error) => { console.error(String(error.stack || error)); process.exit(1); });
