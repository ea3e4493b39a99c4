// A task of the page: the push that closing joints bear, or runs of similar arches.
onmessage = ({ data: { engine, closing, runs, motion } }) => {
  if (closing) {
    const joints = new ClosingJoints(closing.arch, closing.law);
    return postMessage([1, -1].map((side) => joints.peak(closing.q, side, closing.factor)));
  }
  for (const { number, arch, scale } of runs) {
    try {
      postMessage({ number, run: shake(engine, arch, motion, scale) });
    } catch (error) {
      postMessage({ number, run: { failure: error.message } });
    }
  }
};
