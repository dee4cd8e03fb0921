// SPDX-License-Identifier: Apache-2.0
// The data of the page: a JSON document, deflated and in base64. hotpath computed every number in it.

/** How a curve looks: colour and dash tell it apart. */
interface Look {
  label: string; colour: string; dash: number[];
}

/** One of the page's curves: an executor of a run. */
export type Series = Look & { run: number; executor: string };

/** Values at each x, with the ends of their intervals. */
interface Values {
  value: number[]; low: (number | null)[]; high: (number | null)[];
}

export type Line = Look & Values & { x: number[] };

export interface Plot {
  title: string; x: string; log: boolean; lines: Line[];
  figure: string; // id of the figure that it replaces
}

export interface Target {
  kind: "chain" | "task"; name: string; title: string; measure: string;
  figure: string; // id of its violins
  curves: (Values & { series: number; n: number; repetitions: number; q: number[] })[]; // in ms, at the probabilities q; the last is the largest
  marks: { label: string; ms: number; series: number | null }[]; // bounds, deadlines and computation; series null: of all
}

interface StoredRepetition {
  executor: string; repetition: number; length_ns: number; kept_ns: [number, number][];
  jobs: number[][]; // columns: task, sequence since the task's job before, start since the job before, length (-1: it
  // did not end), how long before the start its timestamp and its release were, and thread
}

/** An output as hotpath explains it. */
interface Explained {
  repetition: number; sequence: number; end: number; latency: number; // ns
  causes: number[]; // ns, by cause; empty: unknown
  parts: [cause: number, rule: number, step: number, behind: number, behindSequence: number, ns: number][]; // behind: task that went first (-1: none)
  path: [task: number, sequence: number][];
}

interface Outputs {
  chain?: string; task?: number; executor: string; outputs: Explained[];
}

export interface Run {
  name: string; executors: string[]; tasks: string[]; warm_up_ns: number; notes: string[];
  graph?: {
    nodes: { name: string; type: string; column: number; row: number }[]; edges: [number, number][];
    chains: { name: string; tasks: number[] }[]; node_of_task: number[];
  };
  repetitions?: StoredRepetition[]; outputs?: Outputs[]; responses?: Outputs[];
}

export interface Document {
  causes: { name: string; phrase: string; colour: string }[];
  rules: string[]; series: Series[]; targets: Target[]; runs: Run[]; plots?: Plot[];
  shown?: number; // curves that are switched on at first
}

// Not yet in TypeScript 4.8.
declare const DecompressionStream: new (format: string) => ReadableWritablePair<Uint8Array, Uint8Array>;

export async function readDocument(base64: string): Promise<Document> {
  const text = atob(base64.trim());
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = text.charCodeAt(i); // ten times as fast as from()
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return (await new Response(stream).json()) as Document;
}

/** A job that started; instants in ns since the epoch of its repetition. */
export interface Job {
  task: number; sequence: number; start: number;
  end: number; // of the repetition, for a job that did not end
  timestamp: number; release: number; worker: number; ended: boolean;
}

/** The jobs of one repetition in order of start. */
export class Jobs {
  readonly list: Job[];
  private readonly places: Map<string, Job>;

  constructor(readonly of: StoredRepetition) {
    const [tasks, steps, gaps, lengths, sinceTimestamp, sinceRelease, workers] = of.jobs;
    const sequences: number[] = [];
    let start = 0;
    this.list = tasks.map((task, i) => {
      start += gaps[i];
      const sequence = (sequences[task] = (sequences[task] ?? 0) + steps[i]);
      const ended = lengths[i] >= 0;
      const end = ended ? start + lengths[i] : of.length_ns;
      return { task, sequence, start, end, timestamp: start - sinceTimestamp[i], release: start - sinceRelease[i], worker: workers[i], ended };
    });
    this.places = new Map(this.list.map((job) => [`${job.task} ${job.sequence}`, job]));
  }

  /** A job, unless the page does not have it. */
  find(task: number, sequence: number): Job | undefined {
    return this.places.get(`${task} ${sequence}`);
  }
}

/** An output of a chain, or a job of a task. */
export type Output = Explained & { series: number };

/** The value of a key, made when first needed. */
function cached<K, V>(known: Map<K, V>, key: K, make: () => V): V {
  const value = known.get(key) ?? make();
  known.set(key, value);
  return value;
}

/** Gives views of the document. */
export class Store {
  private readonly jobs = new Map<StoredRepetition, Jobs>();
  private readonly lists = new Map<string, Output[]>();

  readonly running: number; // its place among the causes

  constructor(readonly document: Document) {
    this.running = document.causes.findIndex(({ name }) => name === "running");
  }

  run(series: number): Run {
    return this.document.runs[this.document.series[series].run];
  }

  repetitions(series: number): StoredRepetition[] {
    const { executor } = this.document.series[series];
    return (this.run(series).repetitions ?? []).filter((r) => r.executor === executor);
  }

  /** The jobs of a repetition, or of the first one. */
  jobsOf(series: number, repetition?: number): Jobs | undefined {
    const of = this.repetitions(series).find((r) => repetition === undefined || r.repetition === repetition);
    return of && cached(this.jobs, of, () => new Jobs(of));
  }

  /** All or some of the target's outputs. */
  outputs({ kind, name }: Target, series: number): Output[] {
    return cached(this.lists, `${kind} ${name} ${series}`, () => {
      const { executor } = this.document.series[series];
      const { outputs, responses, tasks } = this.run(series);
      const task = tasks.indexOf(name);
      const lists = kind === "chain" ? outputs : responses;
      const stored = lists?.find((o) => o.executor === executor && (o.chain === name || o.task === task));
      const explained = (stored?.outputs ?? []).map((output) => ({ ...output, series }));
      return kind === "chain" ? explained : this.jobsOfTask(task, series, explained);
    });
  }

  /** All kept jobs of a task, of which the slowest are explained. */
  private jobsOfTask(task: number, series: number, slowest: Output[]): Output[] {
    const warmUp = this.run(series).warm_up_ns;
    const list: Output[] = [];
    const known = new Map(slowest.map((o) => [`${o.repetition} ${o.sequence}`, o]));
    for (const { repetition } of this.repetitions(series)) {
      for (const { task: of, sequence, timestamp, end, ended } of this.jobsOf(series, repetition)?.list ?? []) {
        if (of !== task || !ended || timestamp < warmUp) continue;
        const id = `${repetition} ${sequence}`;
        const { causes, parts } = known.get(id) ?? { causes: [], parts: [] };
        known.delete(id);
        list.push({ series, repetition, sequence, end, latency: end - timestamp, causes, parts, path: [[task, sequence]] });
      }
    }
    return [...list, ...known.values()]; // and those that a thinned page does not keep
  }
}
