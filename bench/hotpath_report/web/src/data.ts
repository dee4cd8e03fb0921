// SPDX-License-Identifier: Apache-2.0
// The data of the page: a JSON document, deflated and in base64. hotpath computed every number in it.

/** How a curve looks: colour and dash tell it apart. */
export interface Look {
  label: string; colour: string; dash: number[];
}

/** One of the page's curves: an executor of a run. */
export interface Series extends Look {
  run: number; executor: string;
}

/** A curve over a quantity, with a value and its interval at each x. */
export interface Line extends Look {
  x: number[]; value: number[]; low: (number | null)[]; high: (number | null)[];
}

export interface Plot {
  title: string; x: string; log: boolean; lines: Line[];
  figure: string; // id of the figure that it replaces
}

/** A distribution at the probabilities `q`, in ms; the last point is the largest sample. */
export interface Curve {
  series: number; n: number; repetitions: number; q: number[]; value: number[]; low: (number | null)[];
  high: (number | null)[];
}

/** A line in a distribution: a bound, a deadline, or the computation on a path. */
export interface Mark {
  label: string; ms: number;
  series: number | null; // null: of all
}

export interface Target {
  kind: "chain" | "task"; name: string; title: string; measure: string;
  figure: string; // id of its violins
  curves: Curve[]; marks: Mark[];
}

export interface Graph {
  nodes: { name: string; type: string; column: number; row: number }[];
  edges: [number, number][];
  chains: { name: string; tasks: number[] }[];
  node_of_task: number[];
}

export interface StoredRepetition {
  executor: string; repetition: number; length_ns: number; kept_ns: [number, number][];
  jobs: number[][]; // columns: task, sequence since the task's job before, start since the job before, length (-1: it
  // did not end), how long before the start its timestamp and its release were, and thread
}

/** An output as hotpath explains it. */
interface Explained {
  repetition: number; sequence: number; end: number; latency: number; // ns
  causes: number[]; // ns, by cause
  parts: number[][]; // cause, rule, step, task that went first (-1: none) and its sequence, ns
  path: [number, number][]; // task and sequence
}

export interface StoredOutputs {
  chain?: string; task?: number; executor: string; outputs: Explained[];
}

export interface Run {
  name: string; source: string; executors: string[]; tasks: string[]; graph?: Graph;
  repetitions?: StoredRepetition[]; outputs?: StoredOutputs[]; responses?: StoredOutputs[]; warm_up_ns: number;
  notes: string[];
}

export interface Cause {
  name: string; phrase: string; colour: string;
}

export interface Document {
  causes: Cause[]; rules: string[]; series: Series[]; targets: Target[]; runs: Run[]; plots?: Plot[];
  shown?: number; // curves that are switched on at first
}

interface ByteStream {
  readable: ReadableStream<Uint8Array>; writable: WritableStream<Uint8Array>;
}
declare const DecompressionStream: new (format: string) => ByteStream; // not yet in TypeScript 4.8

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
      const [timestamp, release] = [start - sinceTimestamp[i], start - sinceRelease[i]];
      return { task, sequence, start, end, timestamp, release, worker: workers[i], ended };
    });
    this.places = new Map(this.list.map((job) => [`${job.task} ${job.sequence}`, job]));
  }

  /** A job, unless the page does not have it. */
  find(task: number, sequence: number): Job | undefined {
    return this.places.get(`${task} ${sequence}`);
  }

  kept(from: number, to: number): boolean {
    return this.of.kept_ns.some(([a, b]) => a <= Math.max(0, from) && to <= b);
  }
}

/** A part of a latency with one cause. */
export interface Part {
  cause: number; rule: number; step: number;
  behind: number; // task; -1: none
  behindSequence: number; ns: number;
}

/** An output of a chain, or a job of a task, whose causes may be unknown. */
export interface Output extends Omit<Explained, "causes" | "parts"> {
  series: number; causes: number[] | null; parts: Part[];
}

/** Gives typed views of the document, made when first needed. */
export class Store {
  private readonly jobs = new Map<StoredRepetition, Jobs>();
  private readonly lists = new Map<string, Output[]>();

  constructor(readonly document: Document) {}

  run(series: number): Run {
    return this.document.runs[this.document.series[series].run];
  }

  repetitions(series: number): StoredRepetition[] {
    const executor = this.document.series[series].executor;
    return (this.run(series).repetitions ?? []).filter((r) => r.executor === executor);
  }

  jobsOf(series: number, repetition: number): Jobs | undefined {
    const of = this.repetitions(series).find((r) => r.repetition === repetition);
    if (!of) return undefined;
    let jobs = this.jobs.get(of);
    if (!jobs) this.jobs.set(of, (jobs = new Jobs(of)));
    return jobs;
  }

  /** All or some of the target's outputs. */
  outputs(target: Target, series: number): Output[] {
    const key = `${target.kind} ${target.name} ${series}`;
    let list = this.lists.get(key);
    if (!list) {
      const { executor } = this.document.series[series];
      const { outputs, responses, tasks } = this.run(series);
      const task = tasks.indexOf(target.name);
      const of = target.kind === "chain" ? outputs?.find((o) => o.chain === target.name && o.executor === executor)
        : responses?.find((o) => o.task === task && o.executor === executor);
      const explained = (of?.outputs ?? []).map((output) => ({
        ...output, series,
        parts: output.parts.map(([cause, rule, step, behind, behindSequence, ns]) => ({ cause, rule, step, behind, behindSequence, ns })),
      }));
      list = target.kind === "chain" ? explained : this.jobsOfTask(task, series, explained);
      this.lists.set(key, list);
    }
    return list;
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
        const { causes, parts } = known.get(id) ?? { causes: null, parts: [] };
        known.delete(id);
        list.push({ series, repetition, sequence, end, latency: end - timestamp, causes, parts, path: [[task, sequence]] });
      }
    }
    return [...list, ...known.values()]; // and those that a thinned page does not keep
  }
}
