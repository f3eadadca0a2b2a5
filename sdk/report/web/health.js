// Says on <html> how the page fares: data-errors counts what went wrong, data-ready is there when
// all of the page stands.
const root = document.documentElement;
export function failed(reason) {
  root.dataset.errors = Number(root.dataset.errors ?? 0) + 1;
  root.dataset.error = String(reason);
}

export function watchErrors() {
  addEventListener('error', (event) => failed(event.message));
  addEventListener('unhandledrejection', (event) => failed(event.reason));
}

export function ready() {
  root.dataset.ready = 'true';
}
