// Gives a program that Emscripten made the environment of node, for getenv.
Module['preRun'] = () => {
  if (typeof ENV !== 'undefined') Object.assign(ENV, process.env);
};
