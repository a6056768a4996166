// The words of the channel between the page and the program.
// Made by `python -m app.web.messages > static/messages.d.ts`; do not edit.

/** A time as JSON carries it: two integers, because a JavaScript number cannot hold nanoseconds of today. */
export interface Stamp {
  sec: number;
  nanosec: number;
}

/** Where 95 % of the residuals of a good pair would lie, around its reprojection. */
export interface Ellipse {
  semi_major_px: number;
  semi_minor_px: number;
  angle_rad: number;
}

/** One click, its mark on the picture and its line in the table. */
export interface ClickRow {
  id: string;
  image_time: Stamp;
  frame: number;
  u_px: number;
  v_px: number;
  state: "pending" | "inlier" | "outlier" | "excluded" | "unpaired";
  projected_px: [number, number] | null;
  residual_px: number | null;
  ellipse: Ellipse | null;
  range_m: number | null;
  azimuth_deg: number | null;
  elevation_deg: number | null;
  returns: number | null;
  outlier_probability: number | null;
  note: string;
}

/** One number as it is shown. */
export interface Figure {
  key: string;
  label: string;
  value: string;
  unit: string;
  hint: string;
  level: "plain" | "good" | "warning";
}

/** Something about the data that a person must decide on. */
export interface DataWarning {
  code: string;
  message: string;
  hint: string;
}

/** Which returns can be the reflector. */
export interface GatingOptions {
  max_speed_mps: number;
  min_range_m: number;
  max_range_m: number;
}

/** How the returns around one click become candidates. */
export interface LocatingOptions {
  window_s: number;
  max_candidates: number;
  max_time_gap_s: number;
}

/** Standard deviations to use where the message gives none; the solver then estimates how far they are off. */
export interface NoiseOptions {
  sigma_px: number;
  sigma_range_m: number;
  sigma_azimuth_deg: number;
  sigma_elevation_deg: number;
  estimate_scale: boolean;
}

/** A tape-measured camera position; no other extra measurement helps as much. */
export interface CameraPositionPrior {
  position_m: [number, number, number];
  sigma_m: number;
}

/** How pairs become a pose (default method). */
export interface SolvingOptions {
  camera_position: CameraPositionPrior | null;
  nominal_camera_distance_m: number;
  seed: number;
}

/** What Algorithm 1 of the paper does not specify. */
export interface PaperOptions {
  z_score_threshold: number;
  z_score_axes: "separately" | "in-turn";
  window: "centred" | "whole-second";
  window_s: number;
  max_range_m: number;
  max_speed_mps: number;
  ransac_threshold_px: number;
  ransac_iterations: number;
  ransac_confidence: number;
}

/** All options of a calibration. */
export interface CalibrationOptions {
  method: "default" | "paper";
  gating: GatingOptions;
  locating: LocatingOptions;
  noise: NoiseOptions;
  solving: SolvingOptions;
  paper: PaperOptions;
}

/** Where to put the reflector next. */
export interface Advice {
  u_px: number;
  v_px: number;
  range_m: number;
  gain: number;
  may_stop: boolean;
  position_radar_m: number[];
  words: string;
}

/** Everything a client draws about the session. */
export interface View {
  type: "view";
  revision: number;
  stage: "collecting" | "solving" | "solved" | "unsolvable";
  status: string;
  hint: string;
  solving: boolean;
  solved_revision: number;
  can_undo: boolean;
  can_redo: boolean;
  has_calibration: boolean;
  method: "default" | "paper";
  clicks: ClickRow[];
  metrics: Figure[];
  pose: Figure[];
  warnings: DataWarning[];
  options: CalibrationOptions;
  residual_limit_px: number | null;
  advice: Advice | null;
  reference: string;
  comparison: Figure[];
}

/** The recording is being opened: at most a picture of it can be seen, and nothing can be clicked yet. */
export interface Opening {
  type: "opening";
  name: string;
  doing: string;
  problem: string;
}

/** Many stamps, as two columns. */
export interface StampColumns {
  sec: number[];
  nanosec: number[];
}

/** How the radar or the camera of the recording is read. */
export interface SensorNote {
  name: string;
  topic: string;
  clock: string;
  about: string[];
}

/** Where the session is kept and what was found there. */
export interface SessionNote {
  folder: string;
  restored_clicks: number;
  note: string;
}

/** What a user needs to know to set one option. */
export interface OptionDescription {
  path: string;
  label: string;
  unit: string;
  hint: string;
  kind: "number" | "integer" | "yes-no" | "choice" | "camera-position";
  choices: string[];
  low: number | null;
  high: number | null;
  default: boolean | number | string | CameraPositionPrior | null;
}

/** Related options; the first group has no name and contains the method. */
export interface OptionGroup {
  name: string;
  hint: string;
  options: OptionDescription[];
}

/** The recording, told once to each page. */
export interface RecordingNote {
  type: "recording";
  name: string;
  radar_topic: string;
  image_topic: string;
  width_px: number;
  height_px: number;
  frame_times: StampColumns;
  start: Stamp;
  radar: StampColumns;
  warnings: DataWarning[];
  sensors: SensorNote[];
  session: SessionNote;
  version: string;
  option_groups: OptionGroup[];
}

/** A dwell of the reflector that the radar has seen. */
export interface PlacementRow {
  start_s: number;
  end_s: number;
  frame: number;
  range_m: number;
  score: number;
}

/** The placements found from the radar alone. */
export interface Placements {
  type: "placements";
  placements: PlacementRow[];
}

/** One radar return on the picture; written as an array, since there are many. */
export type OverlayReturn = [u_px: number, v_px: number, range_m: number, doppler_mps: number | null, snr_db: number | null, static: boolean];

/** The nearest radar scan as the camera would see it. */
export interface Overlay {
  type: "overlay";
  index: number;
  revision: number;
  returns: OverlayReturn[] | null;
  guesses: [number, number][];
}

/** Something long is under way. */
export interface Progress {
  type: "progress";
  label: string;
  done: number;
  total: number;
}

/** Something the person asked for could not be done. */
export interface Problem {
  type: "error";
  message: string;
  hint: string;
  request: number | null;
}

/** A message with a request number was carried out (and kept, if it was a step). */
export interface Done {
  type: "done";
  request: number;
}

/** What comes before the bytes of a picture. */
export interface FrameHeader {
  index: number;
  request: number;
  width_px: number;
  height_px: number;
  scale: number;
  format: "jpeg" | "png";
}

/** A time. */
export interface StampForm {
  sec: number;
  nanosec: number;
}

/** A click in a frame. */
export interface ClickPlacedForm {
  type: "click_placed";
  image_time: StampForm;
  pixel_px: [number, number];
  request?: number;
}

/** A click dragged or nudged. */
export interface ClickMovedForm {
  type: "click_moved";
  id: string;
  pixel_px: [number, number];
  request?: number;
}

/** A click deleted. */
export interface ClickRemovedForm {
  type: "click_removed";
  id: string;
  request?: number;
}

/** A click left out or taken in. */
export interface ClickExcludedForm {
  type: "click_excluded";
  id: string;
  excluded: boolean;
  request?: number;
}

/** Options by group and name; the journal holds all of them, a page may send some. */
export interface OptionsChangedForm {
  type: "options_changed";
  options: Record<string, unknown>;
  request?: number;
}

/** All clicks thrown away. */
export interface ClearedForm {
  type: "cleared";
  request?: number;
}

/** A click, as in a clicks-1 file. */
export interface ClickForm {
  id: string;
  image_time: StampForm;
  pixel_px: [number, number];
  sigma_px?: number | null;
  excluded?: boolean;
}

/** Clicks from a file. */
export interface ClicksImportedForm {
  type: "clicks_imported";
  clicks: ClickForm[];
  request?: number;
}

/** The last change taken back. */
export interface UndoForm {
  type: "undo";
  request?: number;
}

/** The change made again that was taken back last. */
export interface RedoForm {
  type: "redo";
  request?: number;
}

/** A page has opened. */
export interface HelloForm {
  type: "hello";
  request?: number;
}

/** The picture of a frame is wanted; exactly one binary message answers, unless a newer request comes first. */
export interface FrameForm {
  type: "frame";
  index: number;
  request: number;
  playing?: boolean;
  size?: "full" | "half";
}

/** Another frame is looked at. */
export interface CursorForm {
  type: "cursor";
  index: number;
  playing?: boolean;
  selected?: string | null;
  light?: boolean;
  request?: number;
}

/** The 3D view should look from somewhere. */
export interface ViewpointForm {
  type: "viewpoint";
  viewpoint: "behind" | "above" | "side" | "camera";
  request?: number;
}

/** A file of clicks was read. */
export interface ImportForm {
  type: "import_clicks";
  text: string;
  name?: string;
  request?: number;
}

export type FromServer =
  | View
  | Opening
  | RecordingNote
  | Placements
  | Overlay
  | Progress
  | Problem
  | Done;

export type FromPage =
  | ClickPlacedForm
  | ClickMovedForm
  | ClickRemovedForm
  | ClickExcludedForm
  | OptionsChangedForm
  | ClearedForm
  | ClicksImportedForm
  | UndoForm
  | RedoForm
  | HelloForm
  | FrameForm
  | CursorForm
  | ViewpointForm
  | ImportForm;
