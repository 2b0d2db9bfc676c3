// Shows openapi.json to a person.

import { byId, element, write } from "./dom.js";
import { fetchJson } from "./source.js";

function parameterOf({ name, description = "", schema }) {
  const told = schema.enum ? schema.enum.join(", ") : description;
  return element("li", {}, element("code", {}, name), ` ${told}`);
}

function sectionOf(path, { summary, parameters, responses }) {
  const { description, content } = responses["200"];
  return element("section", {},
    element("h2", {}, element("code", {}, `GET ${path}`)),
    element("p", {}, element("strong", {}, summary)),
    element("p", {}, description, " ", element("small", {}, `(${Object.keys(content).join(", ")})`)),
    parameters.length ? element("ul", {}, ...parameters.map(parameterOf)) : null,
    ...Object.entries(responses).filter(([status]) => status !== "200").map(([status, answer]) =>
      element("p", { class: "quiet" }, `${status}: ${answer.description}`)));
}

const described = await fetchJson("/api/openapi.json");
write(byId("description"), described.info.description);
byId("paths").replaceChildren(...Object.entries(described.paths).map(([path, { get }]) => sectionOf(path, get)));
