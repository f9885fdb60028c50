/**
 * Which level of detail a player shows: a coarser one where it cannot keep up, a finer one again once it has kept up for a while.
 *
 * A step of the clock is late if the frame that is due is not decoded, or if the step itself comes late, because the page draws too
 * slowly. Levels change by a factor of about two in vertices. A level that had to be left soon is tried again later each time.
 */

const WINDOW = 1000; // ms that are looked at together
const TOO_LATE = 0.25; // of the window: a coarser level
const IN_TIME = 0.05; // of the window, at most: calm
const LATENESS = 1.5; // of the time between frames, after which a step is late
const REPAINT = 17; // ms; no page has more steps
const PAUSE = 1000; // ms after which a step is no evidence: the page was hidden, or nothing played
const CALM = 4000; // ms until a finer level is tried
const LONGEST_CALM = 60_000;

export class LevelChooser {
  #vertices;
  #before = null; // ms, the last step
  #seen = 0; // ms of the window
  #late = 0; // ms of those that were late
  #calm = 0; // ms without lateness
  #needed = CALM;
  #isTried = false; // whether the level is a finer one that has not held yet

  /** @param {number[]} vertices of each level, the whole mesh first */
  constructor(vertices) {
    this.#vertices = vertices;
  }

  /** Forget the window: the level has changed, or the file was waited for. */
  restart() {
    this.#before = null;
    this.#seen = this.#late = 0;
  }

  /**
   * A step of the clock.
   *
   * @param {number} now ms @param {number} level that is shown @param {boolean} isThere whether the frame that is due was
   * @param {number} due ms between frames
   * @returns {number} the level that is wanted
   */
  step(now, level, isThere, due) {
    const elapsed = now - (this.#before ?? now);
    this.#before = now;
    if (elapsed > PAUSE) this.restart();
    else this.#count(elapsed, !isThere || elapsed > LATENESS * Math.max(due, REPAINT));
    if (this.#seen < WINDOW) return level;
    const [late, seen] = [this.#late / this.#seen, this.#seen];
    this.#seen = this.#late = 0;
    if (late > TOO_LATE) return this.#lower(level);
    this.#calm = late <= IN_TIME ? this.#calm + seen : 0;
    return this.#calm < this.#needed ? level : this.#raise(level);
  }

  #count(elapsed, isLate) {
    this.#seen += elapsed;
    if (isLate) this.#late += elapsed;
  }

  #lower(level) {
    if (this.#isTried) this.#needed = Math.min(2 * this.#needed, LONGEST_CALM);
    this.#isTried = false;
    this.#calm = 0;
    const coarser = this.#vertices.findIndex((count) => 2 * count <= this.#vertices[level]);
    return coarser < 0 ? this.#vertices.length - 1 : coarser;
  }

  #raise(level) {
    if (this.#isTried) this.#needed = CALM; // it has held
    this.#isTried = level > 0;
    this.#calm = 0;
    const finer = this.#vertices.findIndex((count) => count <= 2 * this.#vertices[level]);
    return Math.max(0, Math.min(finer, level - 1));
  }
}
