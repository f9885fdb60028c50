/** The length of the vector of so many components that starts at a place of an array. */
export function length(values, start, components) {
  let sum = 0;
  for (let i = start; i < start + components; i++) sum += values[i] * values[i];
  return Math.sqrt(sum);
}
