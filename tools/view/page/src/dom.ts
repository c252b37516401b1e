/** Small helpers for elements. Texts are always set as text, never as HTML. */

export function find<E extends HTMLElement>(id: string): E {
  const element = document.getElementById(id);
  if (!element) throw new Error(`page: expected an element #${id}`);
  return element as E;
}

type Child = Node | string;

export function make<K extends keyof HTMLElementTagNameMap>(
  name: K, attributes: Record<string, string> = {}, ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

export function setText(element: HTMLElement, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

/** An icon of filled paths in a square of 16. */
export function makeIcon(path: string): SVGSVGElement {
  const space = "http://www.w3.org/2000/svg";
  const icon = document.createElementNS(space, "svg");
  icon.setAttribute("viewBox", "0 0 16 16");
  icon.setAttribute("aria-hidden", "true");
  const shape = document.createElementNS(space, "path");
  shape.setAttribute("d", path);
  icon.append(shape);
  return icon;
}

/** A group of buttons with one choice. Arrow keys move the choice, as in a group of radio buttons. */
export function makeChoice(group: HTMLElement, choose: (button: HTMLButtonElement) => void): void {
  const buttons = [...group.querySelectorAll<HTMLButtonElement>("[role=radio]")];
  const mark = (chosen: HTMLElement) => {
    for (const button of buttons) {
      button.setAttribute("aria-checked", String(button === chosen));
      button.tabIndex = button === chosen ? 0 : -1;
    }
  };
  mark(buttons.find((button) => button.getAttribute("aria-checked") === "true") ?? buttons[0]!);
  for (const button of buttons)
    button.addEventListener("click", () => {
      mark(button);
      choose(button);
    });
  group.addEventListener("keydown", (event) => {
    const move = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    const at = buttons.indexOf(event.target as HTMLButtonElement);
    if (!move || at < 0) return;
    event.preventDefault();
    const next = buttons[(at + move + buttons.length) % buttons.length]!;
    next.focus();
    next.click();
  });
}

/** Asks the user to confirm an action that cannot be undone. */
export function confirmAction(title: string, text: string, action: string): Promise<boolean> {
  const dialog = find<HTMLDialogElement>("confirm");
  const no = make("button", { type: "button", id: "confirm-no" }, "Cancel");
  const yes = make("button", { type: "button", id: "confirm-yes", class: "danger" }, action);
  dialog.replaceChildren(
    make("h2", { id: "confirm-title" }, title), make("p", {}, text), make("div", { class: "buttons" }, no, yes));
  dialog.showModal();
  no.focus();
  return new Promise((resolve) => {
    // The event `close` is not used: it comes later, and may then answer the next question.
    const settle = (answer: boolean) => {
      dialog.close();
      resolve(answer);
    };
    no.onclick = () => settle(false);
    yes.onclick = () => settle(true);
    dialog.oncancel = () => resolve(false); // Escape
  });
}

export function isTyping(event: KeyboardEvent): boolean {
  const target = event.target as HTMLElement;
  return target.matches("input, select, textarea") || document.querySelector("dialog[open]") !== null;
}
