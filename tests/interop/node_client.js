// A round of a Modbus TCP client by jsmodbus or modbus-serial, see foreign_clients.py; prints its results as JSON.
// Ends with status 77 where the package is not found (NODE_PATH names the folder of packages).
const net = require("net");
const [library, port, register, coil] = [process.argv[2], ...process.argv.slice(3).map(Number)];
let made;
try {
    made = require(library);
} catch {
    process.exit(77);
}

const steps = {
    write_registers: (c) => c.writeRegisters(register, [11, 22, 33]),
    read_registers: (c) => c.readRegisters(register, 3),
    write_register: (c) => c.writeRegister(register + 1, 44),
    read_again: (c) => c.readRegisters(register, 3),
    write_coil: (c) => c.writeCoil(coil + 1, true),
    read_coils: (c) => c.readCoils(coil, 3),
    write_coils: (c) => c.writeCoils(coil + 5, [true, false, true]),
    read_inputs: (c) => c.readInputs(20, 3),
    read_input_registers: (c) => c.readInputRegisters(150, 3),
};

async function serial() {
    const client = new made();
    await client.connectTCP("127.0.0.1", { port });
    client.setID(1);
    client.setTimeout(20000);
    const values = (answer) => answer.data.slice(0, 3);
    return {
        writeRegisters: (a, v) => client.writeRegisters(a, v).then(() => true),
        readRegisters: (a, n) => client.readHoldingRegisters(a, n).then(values),
        writeRegister: (a, v) => client.writeRegister(a, v).then(() => true),
        writeCoil: (a, v) => client.writeCoil(a, v).then(() => true),
        readCoils: (a, n) => client.readCoils(a, n).then(values),
        writeCoils: (a, v) => client.writeCoils(a, v).then(() => true),
        readInputs: (a, n) => client.readDiscreteInputs(a, n).then(values),
        readInputRegisters: (a, n) => client.readInputRegisters(a, n).then(values),
        refusal: (error) => error.modbusCode,
        close: () => client.close(() => {}),
    };
}

async function js() {
    const socket = new net.Socket();
    const client = new made.client.TCP(socket, 1, 20000);
    await new Promise((resolve, reject) => socket.once("connect", resolve).once("error", reject).connect(port, "127.0.0.1"));
    const words = (answer) => answer.response.body.valuesAsArray.slice(0, 3);
    const bits = (answer) => answer.response.body.valuesAsArray.slice(0, 3).map(Boolean);
    return {
        writeRegisters: (a, v) => client.writeMultipleRegisters(a, v).then(() => true),
        readRegisters: (a, n) => client.readHoldingRegisters(a, n).then(words),
        writeRegister: (a, v) => client.writeSingleRegister(a, v).then(() => true),
        writeCoil: (a, v) => client.writeSingleCoil(a, v).then(() => true),
        readCoils: (a, n) => client.readCoils(a, n).then(bits),
        writeCoils: (a, v) => client.writeMultipleCoils(a, v).then(() => true),
        readInputs: (a, n) => client.readDiscreteInputs(a, n).then(bits),
        readInputRegisters: (a, n) => client.readInputRegisters(a, n).then(words),
        refusal: (error) => error.response && error.response.body.code,
        close: () => socket.end(),
    };
}

(library === "jsmodbus" ? js() : serial()).then(async (client) => {
    const found = {};
    for (const [name, step] of Object.entries(steps)) {
        try {
            found[name] = await step(client);
        } catch (error) {
            if (!client.refusal(error)) throw error;
            found[name] = `exception ${client.refusal(error)}`;
        }
    }
    client.close();
    console.log(JSON.stringify(found));
}).catch((error) => {
    console.error(error);
    process.exit(1);
});
