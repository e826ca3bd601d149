/** Where the link is. */

import { PROTOCOL } from "../generated/messages";

/** Returns the address of the WebSocket that belongs to a page, for example of `document.baseURI`. */
export function linkAddress(page: string): string {
  const address = new URL(`ws?protocol=${PROTOCOL}`, page);
  address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
  return address.href;
}
