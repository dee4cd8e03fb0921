// SPDX-License-Identifier: Apache-2.0
// The graph of a run, coloured by the selected chain, task and output.

import type { Output, Run, Target } from "./data";
import { h, svg } from "./dom";

const BOX = { width: 150, height: 26, dx: 190, dy: 40 };

export class GraphView {
  private readonly place = h("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Picture of the graph" });
  private readonly text = h("p", { class: "faint small" });
  readonly element = h("section", { class: "graph", "aria-label": "Graph" }, h("h3", {}, "Graph"), this.text, this.place);

  show({ graph, tasks }: Run, target: Target, output: Output | null, seriesColour: string, pathColour: string): void {
    this.element.hidden = !graph;
    if (!graph) return;
    const { nodes, node_of_task: nodeOf } = graph;
    const chain = graph.chains.find((c) => c.name === target.name)?.tasks;
    const selected = new Set((chain ?? [tasks.indexOf(target.name)]).map((task) => nodeOf[task]));
    const path = (output?.path ?? []).map(([task]) => nodeOf[task]);
    const behind = new Set((output?.parts ?? []).map(([, , , task]) => task).filter((task) => task >= 0).map((task) => nodeOf[task]));
    const top = Math.min(...nodes.map((n) => n.row));
    const at = nodes.map((n) => ({ x: n.column * BOX.dx + 8, y: (n.row - top) * BOX.dy + 8 }));
    const lines = graph.edges.map(([a, b]) => {
      const hops = path.some((n, k) => n === a && path[k + 1] === b);
      const [x0, y0, x1, y1] = [at[a].x + BOX.width, at[a].y + BOX.height / 2, at[b].x, at[b].y + BOX.height / 2];
      const d = `M${x0},${y0} C${x0 + 24},${y0} ${x1 - 24},${y1} ${x1},${y1}`;
      return svg("path", { d, class: hops ? "hop" : selected.has(a) && selected.has(b) ? "chosen" : "edge", "marker-end": "url(#hotpath-arrow)" });
    });
    const boxes = nodes.map((node, n) => {
      const kind = path.includes(n) ? "hop" : behind.has(n) ? "behind" : selected.has(n) ? "chosen" : "node";
      return svg("g", { class: kind, transform: `translate(${at[n].x},${at[n].y})` },
        svg("title", {}, `${node.name} (${node.type})`),
        svg("rect", { width: BOX.width, height: BOX.height, rx: 5 }),
        svg("text", { x: BOX.width / 2, y: BOX.height / 2 + 4 }, node.name.length > 22 ? `${node.name.slice(0, 21)}…` : node.name));
    });
    const arrow = svg("marker", { id: "hotpath-arrow", viewBox: "0 0 6 6", refX: 6, refY: 3, markerWidth: 6, markerHeight: 6, orient: "auto" },
      svg("path", { d: "M0,0 L6,3 L0,6 z" }));
    const width = Math.max(...at.map(({ x }) => x)) + BOX.width + 8;
    const height = Math.max(...at.map(({ y }) => y)) + BOX.height + 8;
    const names = (of: Iterable<number>): string => [...new Set(of)].map((n) => nodes[n]?.name ?? "").join(", ");
    const words = path.length ? `way of the data: ${names(path)}; went first: ${names(behind) || "none"}` : `selected: ${names(selected)}`;
    this.place.replaceChildren(svg("svg",
      { viewBox: `0 0 ${width} ${height}`, width, height, role: "img", "aria-label": `Graph; ${words}`, style: `--series: ${seriesColour}; --path: ${pathColour};` },
      svg("defs", {}, arrow), ...lines, ...boxes));
    this.text.textContent = path.length
      ? "Filled: the way of the selected output's data. Dashed: nodes whose jobs went first. Outlined: the rest of the chain."
      : "Outlined: the selected chain or task.";
  }
}
