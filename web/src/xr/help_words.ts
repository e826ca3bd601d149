/** What the menu's help says: short lines, by what the viewer holds. The words are the page's own. */

import { headsetLines } from "../guide/words";

export const CONTROLLER_HELP: readonly string[] = headsetLines(false);
export const HAND_HELP: readonly string[] = headsetLines(true);
