/** The dialog that says how to open this page in a headset: address, QR code, certificate, pairing, cable. */

import { byId, make, setText } from "./dom";

/** What `GET /api/access` answers. */
export interface Access {
  readonly local: string;
  readonly port: number;
  readonly network: readonly string[];
  readonly fingerprint: string | null;
  readonly has_code: boolean;
}

export interface Step {
  readonly title: string;
  readonly text: string;
  /** To be typed or compared as it is; empty: nothing. */
  readonly code: string;
}

/** Returns what to do to get there over the network, in order. */
export function stepsFor(access: Access): readonly Step[] {
  const [address] = access.network;
  if (address === undefined) {
    return [{
      title: "Let the network in",
      text: "This server serves its own machine only. Stop it, and start it again with --lan; its address is then shown here:",
      code: "cathxr run --lan",
    }];
  }
  const steps: Step[] = [
    { title: "Open the address", text: "Headset and server must be in the same network. Type this into the headset's browser, or scan the code:", code: address },
    {
      title: "Accept the certificate",
      text: "The browser warns once, as the certificate is this server's own: choose Advanced, then proceed. To be sure, compare its SHA-256 fingerprint, which begins with",
      code: (access.fingerprint ?? "").slice(0, 23),
    },
    { title: "Press Enter VR or Enter AR", text: "They are at the top of the page.", code: "" },
  ];
  if (!access.has_code) return steps;
  return [...steps, { title: "To steer and record from there", text: "Enter the pairing code that the server's console shows.", code: "" }];
}

/** Returns how to do without a network. */
export function cableStep({ port }: Access): Step {
  return {
    title: "Or by a cable",
    text: `Needs no certificate and no code: with the headset in developer mode on a USB cable, run this on the server's machine, then open http://localhost:${port} in the headset:`,
    code: `adb reverse tcp:${port} tcp:${port}`,
  };
}

function filled(host: HTMLElement, { title, text, code }: Step): HTMLElement {
  host.append(make("strong", "", title), make("span", "", text));
  if (code !== "") host.append(make("code", "", code));
  return host;
}

export class HeadsetDialog {
  private readonly dialog = byId<HTMLDialogElement>("headset");

  constructor(private readonly accessUrl: string) {
    byId("headset-open").addEventListener("click", () => void this.open());
    this.dialog.addEventListener("click", (event) => {
      if (event.target === this.dialog) this.dialog.close(); // the backdrop
    });
  }

  /** Opens the dialog; reason: why what was asked for cannot be had here. */
  async open(reason = ""): Promise<void> {
    const why = byId("headset-reason");
    setText(why, reason);
    why.hidden = reason === "";
    if (!this.dialog.open) this.dialog.showModal();
    try {
      const response = await fetch(this.accessUrl, { cache: "no-store" });
      if (!response.ok) throw new Error(`status ${response.status}`);
      this.show((await response.json()) as Access);
    } catch (error) {
      const sentence = `The server does not say where it is (${error instanceof Error ? error.message : "no answer"}).`;
      byId("headset-steps").replaceChildren(make("p", "trouble", sentence));
      byId("headset-code").hidden = true;
    }
  }

  private show(access: Access): void {
    const [address] = access.network;
    byId("headset-code").hidden = address === undefined;
    if (address !== undefined) {
      byId<HTMLImageElement>("headset-qr").src = new URL(`../qr.svg?address=${encodeURIComponent(address)}`, this.accessUrl).href;
      setText(byId("headset-address"), address);
    }
    const list = make("ol", "steps");
    for (const step of stepsFor(access)) list.append(filled(make("li"), step));
    const others = access.network.slice(1);
    if (others.length > 0) list.firstElementChild?.append(make("span", "", `Also: ${others.join(", ")}`));
    byId("headset-steps").replaceChildren(list, filled(make("div", "aside"), cableStep(access)));
  }
}
