/** Tabs of small screens: one panel at a time. On large screens all panels are shown and the tabs are not. */

export function makeTabs(onChange: () => void): void {
  const tabs = [...document.querySelectorAll<HTMLButtonElement>(".tabs [role=tab]")];
  const show = (tab: HTMLButtonElement): void => {
    document.body.dataset["tab"] = tab.dataset["show"]!;
    for (const each of tabs) {
      each.setAttribute("aria-selected", String(each === tab));
      each.tabIndex = each === tab ? 0 : -1;
    }
    onChange();
  };
  tabs.forEach((tab, index) => {
    tab.tabIndex = index === 0 ? 0 : -1;
    tab.addEventListener("click", () => show(tab));
    tab.addEventListener("keydown", (event) => {
      const step = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
      if (step === 0) return;
      const next = tabs[(index + step + tabs.length) % tabs.length]!;
      next.focus();
      show(next);
    });
  });
}
