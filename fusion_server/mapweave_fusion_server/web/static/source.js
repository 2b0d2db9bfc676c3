// What the server says: JSON on request, and events as they happen.

const SILENCE = 3500; // [ms] after which what is shown may be stale: a report comes every second

const AGAIN = 3000; // [ms] after which a server that refused is asked again

/** Return the JSON at `path`, null where there is none. */
export async function fetchJson(path) {
  const answer = await fetch(path);
  if (answer.status === 404) return null;
  if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
  return answer.json();
}

/** Give an order; return null if it is taken, or else why it is not. */
export async function sendOrder(order) {
  const headers = { "Content-Type": "application/json", "X-Mapweave-Token": sessionStorage.getItem("mapweave-token") ?? "" };
  try {
    const answer = await fetch("/api/orders", { method: "POST", headers, body: JSON.stringify(order) });
    return answer.ok ? null : (await answer.text()).trim();
  } catch {
    return "the coordinator does not answer";
  }
}

/** Follow the events; the browser comes again by itself, with the last id it had.
 *
 * @param {object} on  `version`, `searched`, `team`, `story` and `poses` take what an event says,
 *                     `contact` true or false: whether the server is heard.
 */
export function follow(on) {
  let heard = Date.now();
  let contact = null;
  const tell = (now) => {
    if (now !== contact) on.contact((contact = now));
  };
  const open = () => {
    const source = new EventSource("/events");
    for (const kind of ["version", "searched", "team", "story", "poses"]) {
      source.addEventListener(kind, (event) => {
        heard = Date.now();
        tell(true);
        on[kind](JSON.parse(event.data));
      });
    }
    source.addEventListener("error", () => {
      tell(false);
      if (source.readyState === EventSource.CLOSED) setTimeout(open, AGAIN); // it was refused
    });
  };
  open();
  setInterval(() => {
    if (Date.now() - heard > SILENCE) tell(false);
  }, 500);
}
