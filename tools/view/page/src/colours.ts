const root = document.documentElement;

/** The colour of a custom property; a theme chooses between the two of `light-dark`. */
function readColour(name: string): string {
  root.style.color = `var(--${name})`;
  const { color } = getComputedStyle(root);
  root.style.color = "";
  return color;
}

/**
 * Colours of the vehicle's parts (python/sls/colours.css): the same in dark and light, unlit, so that the colour of a
 * pixel identifies the part. Shapes differ, too: a quadrotor is a frame with rotors, a load a sphere, a reference a reticle.
 */
export const kQuadColour = readColour("quad");
export const kLoadColour = readColour("load");
export const kReferenceColour = readColour("reference");

/** Colours of the page that the theme gives: custom properties of style.css. */
export function readTheme() {
  return {
    background: readColour("scene"),
    grid: readColour("grid"),
    gridMajor: readColour("grid-major"),
    text: readColour("text"),
    muted: readColour("muted"),
    accent: readColour("accent"),
    frame: readColour("frame"),
    outline: readColour("outline"),
    plotGrid: readColour("plot-grid"),
    series: [1, 2, 3, 4, 5, 6, 7, 8].map((index) => readColour(`series-${index}`)),
    bad: readColour("bad"),
  };
}
export type Theme = ReturnType<typeof readTheme>;

/** Calls `act` when the theme changes between dark and light. */
export function onThemeChange(act: () => void): void {
  new MutationObserver(act).observe(root, { attributeFilter: ["data-theme"] });
}
