// Shows openapi.json to a person.

import { byId, element, write } from "./dom.js";
import { fetchJson } from "./source.js";

function parameterOf({ name, description = "", schema }) {
  const told = schema.enum ? schema.enum.join(", ") : description;
  return element("li", {}, element("code", {}, name), ` ${told}`);
}

function sectionOf(path, method, { summary, parameters, requestBody, responses }) {
  const done = Object.keys(responses).find((status) => status.startsWith("2"));
  const { description, content = {} } = responses[done];
  const kinds = Object.keys(content).join(", ");
  return element("section", {},
    element("h2", {}, element("code", {}, `${method.toUpperCase()} ${path}`)),
    element("p", {}, element("strong", {}, summary)),
    element("p", {}, description, kinds ? element("small", {}, ` (${kinds})`) : null),
    parameters.length ? element("ul", {}, ...parameters.map(parameterOf)) : null,
    requestBody ? element("p", {}, "JSON: ", requestBody.description) : null,
    ...Object.entries(responses).filter(([status]) => status !== done).map(([status, answer]) =>
      element("p", { class: "quiet" }, `${status}: ${answer.description}`)));
}

const described = await fetchJson("/api/openapi.json");
write(byId("description"), described.info.description);
byId("paths").replaceChildren(...Object.entries(described.paths).flatMap(([path, methods]) =>
  Object.entries(methods).map(([method, operation]) => sectionOf(path, method, operation))));
