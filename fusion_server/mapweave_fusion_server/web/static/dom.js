// Elements, made without any markup: what came from a robot is text and nothing else.

const SVG = "http://www.w3.org/2000/svg";

/** Return an element with `attributes` and `children`, which are elements or text. */
export function element(tag, attributes = {}, ...children) {
  return filled(document.createElement(tag), attributes, children);
}

/** Return a drawing of one path, for a legend. */
export function icon(viewBox, path, attributes) {
  const drawing = filled(document.createElementNS(SVG, "svg"), { viewBox, "aria-hidden": "true" }, []);
  drawing.append(filled(document.createElementNS(SVG, "path"), { d: path, ...attributes }, []));
  return drawing;
}

function filled(made, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

/** Return the element of the page called `id`. */
export const byId = (id) => document.getElementById(id);

/** Fill `parent` with `children`, but keep those there are that look the same: what has the focus,
 *  or is being clicked just now, stays what it is.
 */
export function refill(parent, children) {
  const before = [...parent.children];
  const kept = children.map((child) => {
    const place = before.findIndex((one) => one?.isEqualNode(child));
    if (place < 0) return child;
    before[place] = null;
    return parent.children[place];
  });
  if (kept.length === parent.children.length && kept.every((child, k) => child === parent.children[k])) return;
  const focused = document.activeElement;
  parent.replaceChildren(...kept);
  if (parent.contains(focused)) focused.focus();
}

/** Write `text` into `target`, if it is not there already: a screen reader says it once. */
export function write(target, text) {
  if (target.textContent !== text) target.textContent = text;
}
