/** Lists that follow a state without being built anew: what has the focus keeps it. */

/**
 * Makes the children of `host` follow `items`: one element for each key, in order. `make` is called for a new key,
 * `update` for every item.
 */
export function keyed<T, E extends HTMLElement>(
  host: HTMLElement, items: readonly T[], key: (item: T) => string, make: (item: T) => E, update: (element: E, item: T) => void,
): void {
  const before = new Map<string, E>();
  for (const child of host.children) before.set((child as E).dataset["key"] ?? "", child as E);
  items.forEach((item, index) => {
    const name = key(item);
    let element = before.get(name);
    before.delete(name);
    if (element === undefined) {
      element = make(item);
      element.dataset["key"] = name;
    }
    if (host.children[index] !== element) host.insertBefore(element, host.children[index] ?? null);
    update(element, item);
  });
  for (const gone of before.values()) gone.remove();
}
