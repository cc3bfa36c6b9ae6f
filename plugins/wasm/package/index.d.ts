/** Solid textures learned from one photograph, evaluated anywhere in 3D space. */

/** "exact": the bits of the desktop. "fast": within 1/1024 of them. */
export type Precision = "exact" | "fast";

export type Vector = readonly [number, number, number];

export interface LoadOptions {
  /** Default "exact". */
  precision?: Precision;
  /** Random seed, a whole number from 0 to 2^64 - 1, above 2^53 - 1 a bigint. Default 0. */
  seed?: number | bigint;
  /** Texels after which the solid repeats (lattice family). Default 0: never. */
  period?: number;
  /** Memory bound of the brick cache in bytes (lattice family). Default 256 MiB. */
  cacheLimitBytes?: number;
  /**
   * Absolute URL of the folder of the package's files, where a bundler moved index.mjs away from
   * them. In Node a file: URL.
   */
  baseUrl?: string | URL;
  /**
   * What solidtex-<precision>.mjs exports, and the bytes of solidtex-<precision>.wasm, where a page
   * carries both itself. Not for loadInWorkers(): a function cannot be sent to workers.
   */
  module?: { create: (settings: object) => Promise<unknown>; wasm: ArrayBuffer | Uint8Array };
}

export interface EvalOptions {
  /** Added to every point in double precision. Default [0, 0, 0]. */
  origin?: Vector;
  /** One float a point: half the edge of the cube to average over, in texels. */
  radii?: ArrayLike<number>;
}

/** A refusal: by the engine, with its message and status, or by this package, with status 1. */
export class SolidtexError extends Error {
  readonly status: number;
}

export interface Texture {
  readonly name: string;
  readonly family: "lattice" | "sampler";
  /** Names such as "albedo.r". */
  readonly channels: readonly string[];
  /** Color space of the albedo. */
  readonly colorSpace: "srgb" | "linear" | "data";
  /** Metadata document of the model. */
  readonly metadata: Record<string, unknown>;

  /** Values at points x, y, z, x, y, z, ... in texels: [point][channel]. */
  evalPoints(points: ArrayLike<number>, options?: EvalOptions): Float32Array;

  /** Values at the centers of the voxels [origin, origin + size): [x][y][z][channel]. */
  evalBox(origin: Vector, size: Vector): Float32Array;

  /** Frees the texture's memory. */
  close(): void;
}

/** Loads a model: the bytes of a .solidtex file, its URL, or in Node its path. */
export function load(
  model: ArrayBuffer | Uint8Array | string | URL,
  options?: LoadOptions,
): Promise<Texture>;

export interface WorkersOptions extends Omit<LoadOptions, "module"> {
  /** Workers, each with a copy of the model and a cache. Default: one for each processor. */
  workers?: number;
}

/** A texture that evaluates in workers: the caller is free meanwhile. Values are the same bits. */
export interface WorkersTexture extends Omit<Texture, "evalPoints" | "evalBox"> {
  evalPoints(points: ArrayLike<number>, options?: EvalOptions): Promise<Float32Array>;
  evalBox(origin: Vector, size: Vector): Promise<Float32Array>;
  /** Ends the workers. Queries that wait are refused. */
  close(): void;
}

/** Loads a model in workers, which share each query's points or voxels. */
export function loadInWorkers(
  model: ArrayBuffer | Uint8Array | string | URL,
  options?: WorkersOptions,
): Promise<WorkersTexture>;
