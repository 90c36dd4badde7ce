// A Modbus TCP server by modbus-serial, in a process of its own: prints its port.  Holds what tables.py says.
// Ends with status 77 where the package is not found (NODE_PATH names the folder of packages).
let ModbusRTU;
try {
    ModbusRTU = require("modbus-serial");
} catch {
    process.exit(77);
}

const COUNT = 65536;
const table = (value) => Array.from({ length: COUNT }, (_, number) => value(number));
const coils = table((number) => number % 2 === 0);
const discreteInputs = table((number) => number % 3 === 0);
const holdingRegisters = table((number) => (1000 + number) & 0xffff);
const inputRegisters = table((number) => (2000 + number) & 0xffff);
const vector = {
    getCoil: (address) => coils[address],
    getDiscreteInput: (address) => discreteInputs[address],
    getHoldingRegister: (address) => holdingRegisters[address],
    getInputRegister: (address) => inputRegisters[address],
    setCoil: (address, value) => { coils[address] = value; },
    setRegister: (address, value) => { holdingRegisters[address] = value; },
};
// The number 0 would be taken as 502: modbus-serial asks only whether a port is given.
const server = new ModbusRTU.ServerTCP(vector, { host: "127.0.0.1", port: "0", unitID: 255 });
server.on("serverError", (error) => { console.error(error); process.exit(1); });
server.on("socketError", () => {});
server.on("initialized", () => console.log(server._server.address().port));
