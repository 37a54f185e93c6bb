// The page: opens the recording that it carries or is given, and plays it.
import {Chunk} from 'recording-format';
import {load} from 'cab-collision';
console.log(Chunk, load);
