/**
 * Colours of the vehicle's parts: the same in dark and light, unlit, so that the colour of a pixel identifies the part.
 * Shapes differ, too: a quadrotor is a frame with rotors, a load a sphere, a reference a reticle.
 */
export const kQuadColour = 0x1f84d6;
export const kLoadColour = 0xe08600;
export const kReferenceColour = 0xc44a9c;

/** Colours of the page that the theme gives: custom properties of style.css. */
export interface Theme {
  background: string;
  grid: string;
  gridMajor: string;
  text: string;
  muted: string;
  accent: string;
  frame: string;
  outline: string;
  plotGrid: string;
  series: string[];
  fault: string;
  event: string;
}

export function readTheme(): Theme {
  const style = getComputedStyle(document.documentElement);
  const get = (name: string) => style.getPropertyValue(`--${name}`).trim();
  return {
    background: get("scene"),
    grid: get("grid"),
    gridMajor: get("grid-major"),
    text: get("text"),
    muted: get("muted"),
    accent: get("accent"),
    frame: get("frame"),
    outline: get("outline"),
    plotGrid: get("plot-grid"),
    series: [1, 2, 3, 4, 5, 6, 7, 8].map((index) => get(`series-${index}`)),
    fault: get("fault"),
    event: get("muted"),
  };
}

/** Calls `act` when the theme changes between dark and light. */
export function onThemeChange(act: () => void): void {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", act);
  new MutationObserver(act).observe(document.documentElement, { attributeFilter: ["data-theme"] });
}
