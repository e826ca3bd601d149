/** What this browser remembers for the page. */

/** Returns the page's storage; null where the person or their organisation has forbidden it. */
export function pageStorage(): Storage | null {
  try {
    return localStorage;
  } catch {
    return null;
  }
}
