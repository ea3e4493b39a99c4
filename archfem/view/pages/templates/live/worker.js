// Runs of slightly different arches, one after another; a newer job ends an older one.
let engine = null, latest = 0;
const pause = () => new Promise((resolve) => { const { port1, port2 } = new MessageChannel(); port1.onmessage = resolve; port2.postMessage(0); });

onmessage = async ({ data: { start, job, asked, closing, runs, motion } }) => {
  if (start) {
    engine = { module: new WebAssembly.Module(start.wasm), leaves: start.leaves };
    return;
  }
  if (closing) {
    const joints = new ClosingJoints(closing.arch, closing.law);
    postMessage({ asked, push: [1, -1].map((side) => joints.peak(closing.q, side, closing.factor)) });
    return;
  }
  latest = job;
  for (const { number, arch, scale } of runs) {
    try {
      const steps = shake(engine, arch, motion, scale);
      for (let step = steps.next(); ; step = steps.next()) {
        await pause();
        if (job !== latest) return;
        if (step.done) {
          postMessage({ job, number, run: step.value });
          break;
        }
      }
    } catch (error) {
      postMessage({ job, number, failure: error.message });
    }
  }
};
