// The lesson panel: its text, the predictions before the run, the check of the program, and at last the solution.

import { at, make } from "/dom.js";

export class LessonPanel {
  constructor(page) {
    this.page = page;
    at("prediction").addEventListener("submit", (event) => {
      event.preventDefault();
      this.predict();
    });
    at("check").addEventListener("click", () => this.check());
    at("solve").addEventListener("click", () => this.solve());
  }

  async begin() {
    const { lesson } = this.page.about;
    if (!lesson) return;
    at("lessonText").replaceChildren(...blocks(lesson.text));
    at("questions").replaceChildren(...lesson.questions.map(([name, question, answer]) => make("label", {},
      question ? `${question} ` : "", make("b", {}, `${name} `), make("input", { name, value: answer, autocomplete: "off" }))));
    at("check").disabled = !lesson.predicted;
    this.tries(lesson.tries_left);
  }

  update() {}

  say(text, isGood) {
    at("feedback").textContent = text;
    at("feedback").classList.toggle("good", isGood);
  }

  tries(left) {
    at("solve").title = left ? `After ${left} more ${left === 1 ? "try" : "tries"}; or click it twice` : "The solution, and why";
    this.left = left;
  }

  async predict() {
    const inputs = [...at("questions").querySelectorAll("input")];
    this.say("looking …", true);
    const found = await this.page.ask("predict", { names: inputs.map((one) => one.name), values: inputs.map((one) => one.value) });
    if (!found) return this.say("", true);
    this.tries(found.tries_left);
    at("check").disabled = Boolean(found.mistake);
    return this.say(found.mistake ? `✗ ${found.mistake}` : "✓ That is what it does. Now let it run (r) and look, then change the program file.", !found.mistake);
  }

  async check() {
    this.say("checking …", true);
    const found = await this.page.ask("check", {});
    if (!found) return this.say("", true);
    this.tries(found.tries_left);
    return this.say(found.mistakes.length ? `✗ Not yet:\n${found.mistakes.join("\n")}` : "✓ Done: the program does all that was asked.", !found.mistakes.length);
  }

  async solve() {
    if (this.left && !this.isSure) {
      this.isSure = true;
      this.say(`Try ${this.left} more time${this.left === 1 ? "" : "s"} first; click again to see it all the same.`, false);
      return;
    }
    const found = await this.page.ask("solution", {});
    if (found) at("solved").textContent = found.text;
    at("solved").hidden = !found;
  }
}

// The few forms of Markdown that lessons use, as elements; every text is a text node.
function blocks(text) {
  return text.split(/\n{2,}/).filter((block) => block.trim()).map((block) => {
    const head = /^(#{1,3}) (.*)$/.exec(block);
    if (head) return make(head[1].length === 1 ? "h2" : "h3", {}, head[2]);
    if (/^( {4}|\t)/.test(block) || block.startsWith("```")) return make("pre", {}, block.replace(/^```.*\n?|```$/gm, "").replace(/^ {4}/gm, ""));
    if (/^[-*] /.test(block)) return make("ul", {}, ...block.split(/\n(?=[-*] )/).map((one) => make("li", {}, ...spans(one.slice(2)))));
    return make("p", {}, ...spans(block));
  });
}

function spans(text) {
  return text.split(/(`[^`]+`)/).map((one) => (one.startsWith("`") ? make("code", {}, one.slice(1, -1)) : one));
}
