// Colours come from the style sheet, so that light and dark are decided in one place.

const NAMES = [
  "floor", "beyond", "dot", "edge", "wall", "ink", "muted", "panel", "robot", "robot-ink", "you", "other", "hair", "gives-way", "limit",
  "heat-low", "heat-high", "line",
];

export function palette() {
  const style = getComputedStyle(document.body);
  const colours = {};
  for (const name of NAMES) colours[name.replace(/-(\w)/g, (_, c) => c.toUpperCase())] = style.getPropertyValue(`--${name}`).trim();
  colours.key = NAMES.map((name) => style.getPropertyValue(`--${name}`)).join();
  return colours;
}

// "#rrggbb" → [r, g, b]
export function rgb(hex) {
  const value = parseInt(hex.slice(1), 16);
  return [value >> 16, (value >> 8) & 255, value & 255];
}

export function alpha(hex, opacity) {
  const [r, g, b] = rgb(hex);
  return `rgba(${r},${g},${b},${opacity})`;
}
