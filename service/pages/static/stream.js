// Server-sent events while the page is visible: a hidden page closes its connection, a lost one is opened again.

const AGAIN = 5000;

/** Call `acts[kind](event)` for the events of an address until the signal is aborted.
 *
 * Calls `isLost(true)` after some seconds without connection, and `isLost(false)` when it is back.
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
      // Browsers reconnect by themselves, but not after an error status.
      if (source?.readyState === EventSource.CLOSED) againTimer = setTimeout(open, AGAIN);
    });
    for (const [kind, act] of Object.entries(acts)) source.addEventListener(kind, act);
    return null;
  }

  document.addEventListener("visibilitychange", open, {signal});
  signal.addEventListener("abort", () => { close(); reached(); });
  open();
}
