// The connection to fbvm: questions with their replies, updates, and coming back after a loss.

import { whenReleased } from "/press.js";

const WAIT_MS = [250, 500, 1000, 2000, 4000];
const token = new URLSearchParams(location.hash.slice(1)).get("token") ?? "";

export class Connection {
  constructor(onOpen, onUpdate, onLost) {
    this.onOpen = onOpen;
    this.onUpdate = onUpdate;
    this.onLost = onLost;
    this.asked = new Map();
    this.number = 0;
    this.tries = 0;
    this.open();
  }

  open() {
    this.socket = new WebSocket(`ws://${location.host}/live?token=${encodeURIComponent(token)}`);
    this.socket.addEventListener("open", () => {
      this.tries = 0;
      this.onOpen();
    });
    this.socket.addEventListener("message", (event) => this.take(JSON.parse(event.data)));
    this.socket.addEventListener("close", () => this.lost());
  }

  lost() {
    for (const { reject } of this.asked.values()) reject(new Error("the connection to fbvm is lost"));
    this.asked.clear();
    this.onLost(this.tries, token !== "");
    setTimeout(() => this.open(), WAIT_MS[Math.min(this.tries++, WAIT_MS.length - 1)]);
  }

  take(message) {
    if (message.update) {
      whenReleased(() => {
        this.onUpdate(message.update);
        requestAnimationFrame(() => this.say({ do: "ready" }));
      });
      return;
    }
    const asked = this.asked.get(message.re);
    this.asked.delete(message.re);
    if (asked && message.error !== undefined) asked.reject(new Error(message.error));
    else if (asked) asked.resolve(message.ok);
  }

  say(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  ask(what, fields = {}) {
    return new Promise((resolve, reject) => {
      if (this.socket.readyState !== WebSocket.OPEN) {
        reject(new Error("the connection to fbvm is lost"));
        return;
      }
      const id = ++this.number;
      this.asked.set(id, { resolve, reject });
      this.say({ id, do: what, ...fields });
    });
  }
}
