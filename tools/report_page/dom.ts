// SPDX-License-Identifier: MIT

export function byId<T extends HTMLElement = HTMLElement>(id: string): T {
  return document.getElementById(id) as T;
}

// Makes an element. Texts become text, whatever they hold.
export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Partial<HTMLElementTagNameMap[K]> & { className?: string } = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  Object.assign(element, properties);
  element.append(...children);
  return element;
}

// A row of buttons of which one is pressed.
export function choices(names: string[], chosen: number, choose: (index: number) => void) {
  const element = make("div", { className: "choices" });
  const press = (index: number) =>
    [...element.children].forEach((button, k) => button.setAttribute("aria-pressed", String(k === index)));
  names.forEach((name, k) => {
    const button = make("button", { type: "button", textContent: name });
    button.addEventListener("click", () => {
      press(k);
      choose(k);
    });
    element.append(button);
  });
  press(chosen);
  return { element, press };
}

// A number with as many digits as its size calls for.
export function number(value: number, digits = 3): string {
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) return value.toExponential(digits - 1);
  return value.toLocaleString("en", { maximumSignificantDigits: Math.max(digits, Math.ceil(Math.log10(size + 1))) });
}

export const count = (value: number): string => value.toLocaleString("en");

export function duration(seconds: number): string {
  if (seconds < 100) return `${Math.round(seconds)} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  return `${(seconds / 3600).toFixed(1)} h`;
}

export function save(name: string, text: string): void {
  const link = make("a", { href: URL.createObjectURL(new Blob([text])), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
