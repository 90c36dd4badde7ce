// What is drawn while a button, or a name in a rung, is held waits until it is let go: a browser drops the click on what was
// replaced in between.

const PRESSED = "button, a, summary, select, text[data-name]";
let isPressed = false;
let waiting = [];

function release() {
  isPressed = false;
  const calls = waiting;
  waiting = [];
  for (const call of calls) call();
}

export function whenReleased(call) {
  if (isPressed) waiting.push(call);
  else call();
}

const press = (event) => {
  if (event.target.closest?.(PRESSED)) isPressed = true;
};
addEventListener("pointerdown", press, true);
addEventListener("keydown", (event) => event.key === " " && press(event), true);
const end = () => isPressed && setTimeout(release);
for (const name of ["pointerup", "pointercancel", "keyup"]) addEventListener(name, end, true);
addEventListener("blur", end); // of the window: the press itself takes the focus from a field
