// All versions on a slider: going back, comparing two, taking one home.

import { byId, element, write } from "./dom.js";
import { clock } from "./format.js";
import { fetchJson } from "./source.js";

const FILES = ["svg", "png", "geojson", "dxf", "json"];
const PLAY = 700; // [ms] a version
const OFFERED = 200; // versions to compare with

export class Timeline {
  /** The version that is shown, 0 before there is any. */
  shown = 0;
  /** The last version there is, 0 before there is any. */
  latest = 0;
  isLatest = true;
  series = null;
  #times = new Map();
  #on;
  #timer = 0;

  /** @param {object} on  `show` takes a version's number and, if they were told, its changes, `compare` one or null. */
  constructor(on) {
    this.#on = on;
    byId("version").addEventListener("input", (event) => this.go(Number(event.target.value)));
    byId("latest").addEventListener("click", () => this.goLatest());
    byId("play").addEventListener("click", () => this.#play());
    byId("compare").addEventListener("change", (event) => this.#compare(Number(event.target.value)));
    byId("link").addEventListener("click", () => this.#copy());
  }

  /** Fetch which versions there are. */
  async load() {
    const { series, versions } = await fetchJson("/api/versions");
    this.series = series;
    this.#times = new Map(versions);
    this.latest = versions.at(-1)?.[0] ?? 0;
    this.#write();
  }

  /** Take a version that has just been made; one of another store begins a new history. */
  async add({ version, created, series, changes }) {
    if (series !== this.series || version !== this.latest + 1) await this.load();
    this.#times.set(version, created);
    this.latest = Math.max(this.latest, version);
    if (this.isLatest || this.shown > version) this.#show(version, changes);
    this.#write();
  }

  /** Show a version, and stay there. */
  go(version) {
    if (!this.#times.has(version)) return;
    this.isLatest = version === this.latest;
    this.#show(version);
    this.#write();
  }

  step(by) {
    this.go(this.shown + by);
  }

  /** Show the latest version, and each that follows. */
  goLatest() {
    this.#stop();
    this.isLatest = true;
    if (this.latest) this.#show(this.latest);
    this.#write();
  }

  /** Return what the address says of the version shown. */
  get hash() {
    const against = byId("compare").value;
    return this.isLatest && !against ? "" : `#v=${this.shown}${against ? `&compare=${against}` : ""}`;
  }

  /** Go where an address leads. */
  follow(hash) {
    const wanted = new URLSearchParams(hash.slice(1));
    const version = Number(wanted.get("v")), against = Number(wanted.get("compare"));
    if (this.#times.has(version)) this.go(version);
    else if (this.latest) this.goLatest();
    if (this.#times.has(against)) {
      byId("compare").value = String(against);
      this.#compare(against);
    }
  }

  #show(version, changes) {
    if (version === this.shown) return;
    this.shown = version;
    this.#on.show(version, changes);
  }

  #compare(version) {
    this.#on.compare(version || null);
    this.#write();
  }

  #play() {
    if (this.#timer) return this.#stop();
    if (this.shown === this.latest) this.go(1);
    this.#timer = setInterval(() => (this.shown < this.latest ? this.step(1) : this.#stop()), PLAY);
    byId("play").setAttribute("aria-pressed", "true");
    return undefined;
  }

  #stop() {
    clearInterval(this.#timer);
    this.#timer = 0;
    byId("play").removeAttribute("aria-pressed");
  }

  async #copy() {
    const { origin, pathname } = location;
    await navigator.clipboard.writeText(`${origin}${pathname}#v=${this.shown}`);
    byId("link").textContent = "Copied";
    setTimeout(() => (byId("link").textContent = "Copy link"), 1500);
  }

  #write() {
    const slider = byId("version"), { latest, shown } = this;
    Object.assign(slider, { min: latest ? 1 : 0, max: latest, value: shown });
    const when = this.#times.has(shown) ? `, ${clock(this.#times.get(shown))}` : "";
    const text = shown ? `Version ${shown} of ${latest}${when}` : "No version yet";
    write(byId("version-text"), text);
    slider.setAttribute("aria-valuetext", text);
    slider.disabled = byId("play").disabled = latest < 2;
    byId("latest").setAttribute("aria-pressed", String(this.isLatest));
    this.#offer();
    this.#writeAddress();
  }

  #writeAddress() {
    // It costs a word with the browser, which is dear while a version is to be shown.
    if (location.hash !== this.hash) history.replaceState(null, "", this.hash || location.pathname);
  }

  #link() {
    const links = byId("downloads");
    if (this.shown && links.children.length === 0) links.append(...FILES.map((suffix) => element("a", {}, suffix.toUpperCase())));
    [...links.children].forEach((link, k) => {
      link.href = `/api/joint/${this.shown}.${FILES[k]}`;
      link.download = `joint-${this.shown}.${FILES[k]}`;
    });
  }

  #offer() {
    this.#link();
    const select = byId("compare"), chosen = select.value;
    if (select === document.activeElement && select.options.length > 1) return; // it may be open
    const numbers = Array.from({ length: Math.min(OFFERED, this.latest) }, (_, k) => this.latest - k);
    const all = chosen && !numbers.includes(Number(chosen)) ? [Number(chosen), ...numbers] : numbers;
    select.replaceChildren(element("option", { value: "" }, "nothing"), ...all.map((number) => element("option", { value: number }, `version ${number}`)));
    select.value = chosen;
  }
}
