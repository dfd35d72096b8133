/** Requests to the study's server. */

/** Longest wait for a reply [ms]. */
const PATIENCE = 15000;

const token = document.querySelector('meta[name="csrf-token"]').content;

/** A request without success; `retry` says that the same request may succeed later. */
export class Problem extends Error {
  constructor(status, body, wait = 0) {
    super(body.message ?? "The server did not understand this page.");
    this.status = status;
    this.body = body;
    this.wait = wait;
    this.retry = status === 0 || status === 408 || status === 429 || status >= 500;
  }
}

export const get = (path) => request("GET", path);
export const post = (path, body) => request("POST", path, body);

async function request(method, path, body) {
  const headers = { Accept: "application/json" };
  if (method === "POST") {
    headers["X-CSRF-Token"] = token;
    headers["Content-Type"] = "application/json";
  }
  let response;
  let content;
  try {
    response = await fetch(path, {
      method,
      headers,
      body: body && JSON.stringify(body),
      cache: "no-store",
      signal: AbortSignal.timeout(PATIENCE),
    });
    content = await response.text();
  } catch {
    throw new Problem(0, { message: "The server cannot be reached." });
  }
  const reply = parsed(content);
  if (response.ok && reply) return reply;
  const status = response.ok ? 502 : response.status; // a proxy's page is no reply
  throw new Problem(status, reply ?? {}, Number(response.headers.get("Retry-After")) || 0);
}

function parsed(text) {
  try {
    return JSON.parse(text);
  } catch {
    return null;
  }
}
