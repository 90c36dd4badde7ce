// What omron-fins says to a PLC by FINS: node fins_conversation.js HOST PORT udp|tcp.  Prints what it got as JSON.
// Status 77 if the package is not installed.
let fins;
try { fins = require("omron-fins"); } catch (error) { process.exit(77); }
const [host, port, protocol] = process.argv.slice(2);
const options = { timeout: 5000, DA1: 1, SA1: protocol === "udp" ? 25 : 0, protocol };
const plc = fins.FinsClient(Number(port), host, options);
const ask = (call) => new Promise((done, failed) => {
    call((error, message) => (error || message.timeout ? failed(error || new Error("no answer")) : done(message.response)));
});
async function converse() {
    const found = {};
    found.words = (await ask((then) => plc.read("D100", 3, then))).values;
    found.written = (await ask((then) => plc.write("D500", [41], then))).endCode;
    do { found.answer = (await ask((then) => plc.read("D501", 1, then))).values[0]; } while (found.answer !== 42);
    found.many = (await ask((then) => plc.write("D1000", Array.from({ length: 114 }, (_, at) => at), then))).endCode;
    found.last = (await ask((then) => plc.read("D1113", 1, then))).values[0];
    await ask((then) => plc.write("W10.3", [1], then));
    do { found.bit = (await ask((then) => plc.read("W11.0", 1, then))).values[0]; } while (!found.bit);
    await ask((then) => plc.fill("D600", 7, 10, then));
    await ask((then) => plc.transfer("D600", "D700", 10, then));
    found.copied = (await ask((then) => plc.read("D709", 2, then))).values;
    found.several = (await ask((then) => plc.readMultiple(["D100", "D102"], then))).values;
    found.model = (await ask((then) => plc.cpuUnitDataRead(then))).result.CPUUnitModel;
    await ask((then) => plc.clockWrite({ year: 26, month: 11, day: 22, hour: 13, minute: 44, second: 4, day_of_week: 0 }, then));
    const clock = (await ask((then) => plc.clockRead(then))).result;
    found.clock = [clock.year, clock.month, clock.day, clock.hour, clock.minute];
    found.status = (await ask((then) => plc.status(then))).result;
    found.stopped = (await ask((then) => plc.stop(then))).endCode;
    found.ran = (await ask((then) => plc.run(then))).endCode;
    console.log(JSON.stringify(found));
}
plc.on("error", (error) => { console.error(String(error)); process.exit(1); });
const begin = () => converse().then(() => process.exit(0), (error) => { console.error(String(error)); process.exit(1); });
plc.on("open", () => setImmediate(begin)); // it is connected behind this event only
