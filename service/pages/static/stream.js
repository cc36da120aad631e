// Server-sent events for as long as somebody looks: a hidden page holds no connection, a lost one is taken up again.

const AGAIN = 5000;

/** Call `acts[kind](event)` for the events of an address until the signal is aborted.
 *
 * `isLost(true)` when the connection has been away for some seconds, `isLost(false)` when it is back.
 */
export function listen(address, acts, signal, isLost = () => {}) {
  let source = null;
  let lateTimer = 0;
  let againTimer = 0;

  function close() {
    clearTimeout(againTimer);
    source?.close();
    source = null;
  }

  function reached() {
    clearTimeout(lateTimer);
    lateTimer = 0;
  }

  function open() {
    close();
    if (signal.aborted || document.hidden) return reached();
    source = new EventSource(address);
    source.addEventListener("open", () => {
      reached();
      isLost(false);
    });
    source.addEventListener("error", () => {
      lateTimer ||= setTimeout(() => isLost(true), AGAIN);
      // A browser connects again by itself, but not after an answer that is an error.
      if (source?.readyState === EventSource.CLOSED) againTimer = setTimeout(open, AGAIN);
    });
    for (const [kind, act] of Object.entries(acts)) source.addEventListener(kind, act);
    return null;
  }

  document.addEventListener("visibilitychange", open, {signal});
  signal.addEventListener("abort", () => { close(); reached(); });
  open();
}
