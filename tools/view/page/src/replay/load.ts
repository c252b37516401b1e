/** Gets the bytes of a recording: from sls_view, or from the page itself. */
import { parseRecording, type Recording } from "./recording";

/** `source`: an address, or `#id` of a data block. @throws Error with a text that the page shows. */
export async function loadRecording(source: string): Promise<Recording> {
  const bytes = source.startsWith("#") ? readBlock(source.slice(1)) : await fetchBytes(source);
  try {
    return parseRecording(bytes);
  } catch (error) {
    throw new Error(`${source}: ${error instanceof Error ? error.message : String(error)}`);
  }
}

async function fetchBytes(address: string): Promise<ArrayBuffer> {
  let response;
  try {
    response = await fetch(address);
  } catch {
    throw new Error(`${address}: expected a recording, got no answer from sls_view; is it still running?`);
  }
  if (!response.ok) throw new Error(`${address}: expected a recording, got HTTP status ${response.status}`);
  if (/^text/.test(response.headers.get("Content-Type") ?? "")) throw new Error((await response.text()).trim());
  return response.arrayBuffer();
}

function readBlock(id: string): ArrayBuffer {
  const block = document.getElementById(id);
  if (!block) throw new Error(`#${id}: expected a data block in the page, got none`);
  let letters;
  try {
    letters = atob(block.textContent?.trim() ?? "");
  } catch {
    throw new Error(`#${id}: expected base64, got other letters`);
  }
  return Uint8Array.from(letters, (letter) => letter.charCodeAt(0)).buffer;
}
