// SPDX-License-Identifier: Apache-2.0
// Elements, numbers and colours. Names from runs only ever become text nodes and attribute values.

type Child = Node | string | null;
type Attributes = Record<string, string | number | boolean | ((event: never) => void)>;

function fill<E extends Element>(element: E, attributes: Attributes, children: Child[]): E {
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name, value as EventListener);
    else if (value !== false) element.setAttribute(name, value === true ? "" : String(value));
  }
  element.append(...children.filter((c): c is Node | string => c !== null));
  return element;
}

export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  return fill(document.createElement(tag), attributes, children);
}

export function svg(tag: string, attributes: Attributes = {}, ...children: Child[]): SVGElement {
  return fill(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);
}

export const NS_PER_MS = 1e6;

/** Milliseconds with the digits that jobs.csv resolves in a tooltip or table. */
export function ms(ns: number): string {
  return (ns / NS_PER_MS).toFixed(3);
}

export function percent(q: number): string {
  return `${Number((100 * q).toPrecision(6))} %`;
}

/** Value of one of the page's CSS variables, which follow its light or dark theme. */
export function theme(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

/** Calls `redraw` when the theme changes. */
export function onTheme(redraw: () => void): void {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
}

/** Calls `resized` when the width of an element is not the one for which it was drawn. */
export function onWidth(element: Element, drawn: () => number | undefined, resized: () => void): void {
  new ResizeObserver(() => {
    const width = Math.floor(element.clientWidth);
    if (width > 0 && width !== drawn()) resized();
  }).observe(element);
}

/** A line with the colour and dash of a curve, for legends. */
export function swatch(colour: string, dash: number[]): SVGElement {
  const line = svg("line", { x1: 0, y1: 5, x2: 26, y2: 5, stroke: colour, "stroke-width": 2.5 });
  if (dash.length) line.setAttribute("stroke-dasharray", dash.join(" "));
  return svg("svg", { width: 26, height: 10, "aria-hidden": "true", class: "swatch" }, line);
}
