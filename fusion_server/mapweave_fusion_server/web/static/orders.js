// What a person orders: pins, bans and taking back, each after a question.

import { byId, element, refill, write } from "./dom.js";
import { clock } from "./format.js";
import { fetchJson, sendOrder } from "./source.js";

const DONE = { pin: "pins", forbid: "forbids", forget: "forgets" };
const EFFECTS = { waits: "waits: what it is about is not here", outranked: "outranked by later orders" };
const NAME = "mapweave-operator";

let operator = null; // as whom the certificate of this browser says we come

/** Learn who we are. */
export async function learnOperator() {
  operator = (await fetchJson("/api/me"))?.operator ?? null;
}

/** Whether this page knows the secret that orders need, or is an operator's. */
const mayOrder = () => operator !== null || sessionStorage.getItem("mapweave-token") !== null;

/** Return what an order is about, in a few words. */
const aboutOf = (order) => (order.kind === "forget" ? `${order.robot}@${order.boots.join(", ")}` : `${order.reference} – ${order.other}`);

/** Fill `target` with the orders of a version. */
export function fillOrders(target, joint) {
  const orders = joint.orders ?? [];
  byId("orders-section").hidden = orders.length === 0;
  refill(target, orders.map(itemOf));
}

function itemOf(order) {
  const effect = EFFECTS[order.effect];
  return element("li", { "data-order": order.id },
    element("strong", {}, `${order.by} ${DONE[order.kind]} ${aboutOf(order)}`),
    element("small", {}, `${clock(order.time)} · ${order.reason}`),
    effect ? element("small", { class: "gone" }, effect) : null,
    mayOrder() ? element("button", { type: "button", onclick: () => askToTakeBack(order) }, "Take back…") : null);
}

/** Fill `target` with the marks of a version. */
export function fillMarks(target, joint) {
  const marks = joint.components.flatMap((component) => (component.marks ?? []).map((mark) => ({ ...mark, frame: Object.keys(component.robots)[0] })));
  byId("marks-section").hidden = marks.length === 0;
  refill(target, marks.map(({ label, by, time, component, position: [x, y], frame }) => element("li", {},
    element("strong", {}, label),
    element("small", {}, `${clock(time)} · by ${by}, on the map of ${component}, at ${x.toFixed(1)}, ${y.toFixed(1)} m of ${frame}`))));
}

/** Return the buttons by which a decision is confirmed or forbidden; nothing where none may be given. */
export function buttonsFor(alignment) {
  if (!mayOrder()) return null;
  const { reference, other, evidence } = alignment;
  const found = Object.keys(evidence).length > 0;
  return element("div", { class: "buttons" },
    found ? element("button", { type: "button", onclick: () => askToPin(alignment) }, "Pin this join…") : null,
    element("button", { type: "button", onclick: () => askToForbid(reference, other) }, "Forbid this join…"));
}

function askToPin({ reference, other, transform }) {
  ask(`Pin ${reference} and ${other}?`, "They are joined as shown, whatever else is found, until the order is taken back.", "Pin",
    { kind: "pin", reference, other, transform });
}

function askToForbid(reference, other) {
  ask(`Forbid to join ${reference} and ${other}?`, "They are not joined, not by way of others either, until the order is taken back.", "Forbid",
    { kind: "forbid", reference, other });
}

function askToTakeBack(order) {
  ask(`Take back the order about ${aboutOf(order)}?`, `${order.by} ${DONE[order.kind]} it: ${order.reason}`, "Take back", { takes_back: order.id });
}

/** Ask for a name and a reason; give the order when it is confirmed. */
function ask(title, text, deed, order) {
  const dialog = byId("order"), name = byId("order-name"), reason = byId("order-reason"), confirm = byId("order-confirm");
  write(byId("order-title"), title);
  write(byId("order-text"), text);
  write(confirm, deed);
  write(byId("order-problem"), "");
  name.value = operator ?? localStorage.getItem(NAME) ?? "";
  name.readOnly = operator !== null;
  reason.value = "";
  confirm.onclick = async () => {
    if (!name.reportValidity() || !reason.reportValidity()) return;
    localStorage.setItem(NAME, name.value);
    confirm.disabled = true;
    const problem = await sendOrder({ ...order, by: name.value, reason: reason.value });
    confirm.disabled = false;
    if (problem === null) dialog.close();
    else write(byId("order-problem"), problem);
  };
  byId("order-cancel").onclick = () => dialog.close();
  dialog.showModal();
}
