/** The plotted quantities, and their computation from a row. */
import { Columns, type Run } from "./types";

const kDegrees = 180 / Math.PI;

export interface Series {
  label: string;
  calc: (row: Float32Array) => number;
}

export interface PlotDescription {
  key: string;
  title: string;
  unit: string;
  series: Series[];
}

/** Roll, pitch and yaw in radians of the attitude w, x, y, z: turns about z, then y, then x. */
export function calcEuler(w: number, x: number, y: number, z: number): [number, number, number] {
  return [
    Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
    Math.asin(Math.max(-1, Math.min(1, 2 * (w * y - z * x)))),
    Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
  ];
}

/** The plots of a run, without those for which it has no columns. */
export function describePlots(run: Run): PlotDescription[] {
  const columns = new Columns(run.columns);
  const plots: PlotDescription[] = [];
  const plain = (name: string, label: string, factor = 1): Series[] => {
    const place = columns.find(name);
    return place < 0 ? [] : [{ label, calc: (row) => row[place]! * factor }];
  };
  const add = (key: string, title: string, unit: string, series: Series[]) => {
    if (series.length > 0) plots.push({ key, title, unit, series });
  };

  const error = ["x", "y", "z"].flatMap((axis) => {
    const [load, reference] = [columns.find(`load_${axis}_m`), columns.find(`ref_${axis}_m`)];
    return load < 0 || reference < 0 ? [] : [{ label: axis, calc: (row: Float32Array) => row[load]! - row[reference]! }];
  });
  add("error", "Tracking error", "m", error);
  const apart = ["x", "y", "z"].map((axis) => [columns.find(`quad_${axis}_m`), columns.find(`load_${axis}_m`)] as const);
  if (run.load) {
    add("tension", "Cable tension", "N", plain("cable_tension_n", "tension"));
    add("length", "Cable length, and distance of its ends", "m", [
      ...plain("cable_length_m", "length"),
      { label: "distance", calc: (row) => Math.hypot(...apart.map(([a, b]) => row[a]! - row[b]!)) },
    ]);
  }
  add("rod", run.load ? "Cable angles" : "Rod angles", "°", [...plain("alpha_rad", "α", kDegrees), ...plain("beta_rad", "β", kDegrees)]);
  // What is far from zero, such as a weight or a turn, would flatten what varies about it.
  add("force", "Force x, y", "N", ["x", "y"].flatMap((axis) => plain(`force_${axis}_n`, axis)));
  add("force_z", "Force z", "N", plain("force_z_n", "z"));
  const attitude = (prefix: string): Series[] => {
    const places = ["w", "x", "y", "z"].map((axis) => columns.find(`${prefix}${axis}`));
    if (!places.every((place) => place >= 0)) return [];
    const [w, x, y, z] = places as [number, number, number, number];
    return ["roll", "pitch", "yaw"].map((label, index) => ({
      label,
      calc: (row: Float32Array) => calcEuler(row[w]!, row[x]!, row[y]!, row[z]!)[index]! * kDegrees,
    }));
  };
  const addAttitude = (prefix: string, title: string) => {
    add(prefix, `${title}: roll, pitch`, "°", attitude(prefix).slice(0, 2));
    add(`${prefix}yaw`, `${title}: yaw`, "°", attitude(prefix).slice(2));
  };
  if (run.has_attitude) addAttitude("att_", "Attitude");
  if (run.load && run.load.outline_m.length > 0) addAttitude("load_att_", "Load attitude");
  const rotors = run.columns.filter(({ name }) => /^rotor_\d+_rad_s$/.test(name));
  add("rotors", "Rotors", "rad/s", rotors.slice(0, 8).flatMap(({ name }) => plain(name, name.split("_")[1]!)));
  add("speed", "Load velocity", "m/s", ["x", "y", "z"].flatMap((axis) => plain(`load_v${axis}_m_s`, axis)));
  return plots;
}
