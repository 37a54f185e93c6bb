export default {optimizeDeps: {exclude: ['cab-collision']}};
