/** One load of a file by the element, in steps. It is over when another is asked for, or the element is gone. */
export class Load {
  #controller = new AbortController();

  /** What ends requests, too. @returns {AbortSignal} */
  get signal() {
    return this.#controller.signal;
  }

  get isOver() {
    return this.signal.aborted;
  }

  /** Make it over. */
  end() {
    this.#controller.abort(new DOMException("another file was asked for", "AbortError"));
  }

  /** Throw if it is over. */
  check() {
    this.signal.throwIfAborted();
  }

  /** Wait for something; throw if the load is over by then. @template T @param {Promise<T>} promise @returns {Promise<T>} */
  async step(promise) {
    const result = await promise;
    this.check();
    return result;
  }
}
